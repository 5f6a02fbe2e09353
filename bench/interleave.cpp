#include "bench/interleave.h"

#include <algorithm>

#include "common/base/stopwatch.h"

namespace mray::bench {
namespace {

double run_ms(const Method& method) {
    if (method.prepare) method.prepare();
    const Stopwatch watch;
    method.run();
    return watch.ms();
}

}  // namespace

std::vector<Samples> time_interleaved(std::span<const Method> methods, int repeat) {
    for (const Method& method : methods) run_ms(method);
    std::vector<Samples> samples(methods.size());
    for (int round = 0; round < repeat; ++round) {
        for (std::size_t i = 0; i < methods.size(); ++i) {
            samples[i].push_back(run_ms(methods[i]));
        }
    }
    return samples;
}

Ratio ratio_of(const Samples& ours, const Samples& peer) {
    Ratio ratio;
    ratio.median = median(peer) / median(ours);
    ratio.min = ratio.max = peer[0] / ours[0];
    for (std::size_t i = 1; i < ours.size(); ++i) {
        ratio.min = std::min(ratio.min, peer[i] / ours[i]);
        ratio.max = std::max(ratio.max, peer[i] / ours[i]);
    }
    return ratio;
}

}  // namespace mray::bench
