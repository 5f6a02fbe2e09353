#include "lab/bench/interleave.h"

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

std::vector<Times> time_parts(std::span<const PartMethod> methods, std::size_t parts, int repeat) {
    // By method, then by part.
    std::vector<std::vector<Samples>> samples(methods.size(), std::vector<Samples>(parts));
    // The first round warms up.
    for (int round = -1; round < repeat; ++round) {
        for (std::size_t i = 0; i < methods.size(); ++i) {
            const std::size_t turn = (i + static_cast<std::size_t>(round + 1)) % methods.size();
            const PartMethod& method = methods[turn];
            if (method.prepare) method.prepare();
            for (std::size_t part = 0; part < parts; ++part) {
                const Stopwatch watch;
                method.run(part);
                if (round >= 0) samples[turn][part].push_back(watch.ms());
            }
        }
    }
    std::vector<Times> times;
    times.reserve(samples.size());
    for (const std::vector<Samples>& of_method : samples) times.push_back(times_of(of_method));
    return times;
}

Times times_of(const Samples& samples) { return times_of(std::span(&samples, 1)); }

Times times_of(std::span<const Samples> parts) {
    Times times;
    times.rounds.resize(parts.front().size());
    for (const Samples& part : parts) {
        times.median_ms += median(part);
        times.least_ms += *std::min_element(part.begin(), part.end());
        for (std::size_t round = 0; round < part.size(); ++round)
            times.rounds[round] += part[round];
    }
    return times;
}

Ratio ratio_of(const Times& ours, const Times& peer) {
    Ratio ratio{};
    ratio.median = peer.median_ms / ours.median_ms;
    ratio.least = peer.least_ms / ours.least_ms;
    ratio.min = ratio.max = peer.rounds[0] / ours.rounds[0];
    for (std::size_t i = 1; i < ours.rounds.size(); ++i) {
        ratio.min = std::min(ratio.min, peer.rounds[i] / ours.rounds[i]);
        ratio.max = std::max(ratio.max, peer.rounds[i] / ours.rounds[i]);
    }
    return ratio;
}

}  // namespace mray::bench
