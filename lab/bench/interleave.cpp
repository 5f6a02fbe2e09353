#include "lab/bench/interleave.h"

#include <algorithm>

#include "common/report/spread.h"

namespace mray::bench {

std::vector<Times> time_in_turn(std::span<const Method> methods, std::size_t parts, int repeat) {
    // By method, then by part.
    std::vector<std::vector<Samples>> samples(methods.size(), std::vector<Samples>(parts));
    // The first round warms up.
    for (int round = -1; round < repeat; ++round) {
        for (std::size_t i = 0; i < methods.size(); ++i) {
            const std::size_t turn = (i + static_cast<std::size_t>(round + 1)) % methods.size();
            const Method& method = methods[turn];
            if (method.prepare) method.prepare();
            for (std::size_t part = 0; part < parts; ++part) {
                const double ms = method.run(part);
                if (round >= 0) samples[turn][part].push_back(ms);
            }
        }
    }
    std::vector<Times> times;
    for (const std::vector<Samples>& of_method : samples) times.push_back(times_of(of_method));
    return times;
}

Times times_of(std::span<const Samples> parts) {
    Times times;
    for (const Samples& part : parts) {
        times.median_ms += median(part);
        times.least_ms += *std::min_element(part.begin(), part.end());
    }
    return times;
}

std::vector<std::size_t> fastest_of_groups(std::span<const Method> methods,
                                           std::span<const Times> times, std::size_t count) {
    std::vector<std::size_t> fastest;
    for (std::size_t i = 0; i < methods.size(); ++i) {
        std::vector<std::size_t> group;
        for (std::size_t k = 0; k < methods.size(); ++k) {
            if (methods[k].group == methods[i].group) group.push_back(k);
        }
        // Each group is handled at its first method.
        if (group.front() != i) continue;
        std::stable_sort(group.begin(), group.end(), [&](std::size_t a, std::size_t b) {
            return times[a].least_ms < times[b].least_ms;
        });
        group.resize(std::min(count, group.size()));
        fastest.insert(fastest.end(), group.begin(), group.end());
    }
    return fastest;
}

}  // namespace mray::bench
