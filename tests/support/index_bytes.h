// Small index files, and their checksums.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "clips/index/clip_index.h"
#include "common/base/hash.h"

namespace mray::test {

/// Returns the index of a clip of three files, the second of which is damaged.
inline ClipIndex three_frames() {
    const double lower[3] = {-1, 0, 2};
    const double upper[3] = {4, 0, 2.5};
    WorldBounds bounds;
    bounds.extend(lower, upper);
    ClipIndex index;
    index.topology_hash = 0x0123456789ABCDEF;
    index.vertex_count = 3;
    index.files = {{"f_1.obj", 40, 1'700'000'000'000'000'000, 1},
                   {"f_2.obj", 41, 1'700'000'000'000'000'001, 2},
                   {"f_3.obj", 0, -1, ~std::uint64_t{0}}};
    index.facts.bounds = {KeyframeBounds(bounds), KeyframeBounds(), KeyframeBounds(bounds)};
    index.facts.damaged = {1};
    return index;
}

/// Makes the last eight bytes the checksum of those before.
inline void set_checksum(std::vector<std::byte>& bytes) {
    const std::size_t size = bytes.size() - sizeof(std::uint64_t);
    const std::uint64_t sum = Hasher().add(std::span<const std::byte>(bytes).first(size)).digest();
    std::memcpy(bytes.data() + size, &sum, sizeof sum);
}

}  // namespace mray::test
