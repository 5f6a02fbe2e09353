#include "common/bvh/builder/repeated_triangles.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "common/base/hash.h"

namespace mray {

std::size_t remove_repeated(const Topology& topology, std::span<PrimRef> refs,
                            std::vector<RepeatedTriangle>& repeated) {
    constexpr std::size_t kMostPlaces = std::size_t{1} << 16;
    constexpr std::uint32_t kNone = 0xFFFFFFFFu;
    // For each hash the last triangle that was kept with it.
    std::vector<std::uint32_t> kept(std::min(std::bit_ceil(2 * refs.size()), kMostPlaces), kNone);
    std::size_t count = 0;
    for (const PrimRef& ref : refs) {
        const uvec3& triangle = topology.triangles[ref.prim_id()];
        std::uint32_t& place = kept[hash_of(triangle) & (kept.size() - 1)];
        if (place != kNone && topology.triangles[place] == triangle) {
            repeated.push_back({place, ref.prim_id()});
            continue;
        }
        place = ref.prim_id();
        refs[count++] = ref;
    }
    return count;
}

}  // namespace mray
