#include "lab/bench/peer.h"

#include <algorithm>

namespace mray::bench {

std::vector<std::size_t> fastest_of_groups(std::span<const Peer> peers,
                                           std::span<const Times> times, std::size_t count) {
    std::vector<std::size_t> fastest;
    for (std::size_t i = 0; i < peers.size(); ++i) {
        const auto same_group = [&](const Peer& peer) { return peer.group == peers[i].group; };
        // Each group is handled at its first peer.
        if (std::any_of(peers.begin(), peers.begin() + static_cast<std::ptrdiff_t>(i), same_group))
            continue;
        std::vector<std::size_t> group;
        for (std::size_t k = i; k < peers.size(); ++k) {
            if (same_group(peers[k])) group.push_back(k);
        }
        std::stable_sort(group.begin(), group.end(), [&](std::size_t a, std::size_t b) {
            return times[a].least_ms < times[b].least_ms;
        });
        group.resize(std::min(count, group.size()));
        fastest.insert(fastest.end(), group.begin(), group.end());
    }
    return fastest;
}

}  // namespace mray::bench
