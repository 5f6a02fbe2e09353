// Which corners of a mesh look smooth together.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <unordered_map>

#include "common/base/hash.h"
#include "common/interop/platform.h"

namespace mray {

/// Numbers corners: one has the number of the first corner with the same position and normal.
class SmoothNumbers {
public:
    /// A vertex whose number is not known.
    static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
    /// The bits of a position or vertex and of a normal.
    using Key = std::array<std::uint32_t, 6>;

    /// The bits of a number, those of 0 for -0.
    static std::uint32_t bits(float x) { return std::bit_cast<std::uint32_t>(x + 0.0f); }

    std::uint32_t number_of(const Key& key, std::uint32_t corner) {
        return firsts_.try_emplace(key, corner).first->second;
    }
    /// The number of a corner of a vertex. Keeps it in `number`, which the vertex's corners share.
    std::uint32_t number_of(std::uint32_t& number, const vec3& position, const vec3& normal,
                            std::uint32_t corner) {
        if (number == kNone) {
            number = number_of({bits(position.x), bits(position.y), bits(position.z),
                                bits(normal.x), bits(normal.y), bits(normal.z)},
                               corner);
        }
        return number;
    }

private:
    struct KeyHash {
        std::size_t operator()(const Key& key) const {
            return static_cast<std::size_t>(hash_of(key));
        }
    };
    std::unordered_map<Key, std::uint32_t, KeyHash> firsts_;
};

}  // namespace mray
