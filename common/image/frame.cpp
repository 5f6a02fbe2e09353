#include "common/image/frame.h"

#include <algorithm>

#include "common/base/hash.h"

namespace mray {

std::uint64_t count_hits(const Frame& frame) {
    return static_cast<std::uint64_t>(
        std::count_if(frame.hits.begin(), frame.hits.end(),
                      [](const Hit& hit) { return hit.prim_id != kNoPrim; }));
}

std::uint64_t hits_hash(const Frame& frame) {
    return Hasher().add(std::span(frame.hits)).add(std::span(frame.occlusion)).digest();
}

std::uint64_t image_hash(const Frame& frame) { return image_hash(frame.pixels); }

std::uint64_t image_hash(std::span<const std::uint32_t> pixels) {
    return Hasher().add(pixels).digest();
}

}  // namespace mray
