// Which corners of a glTF mesh look smooth together.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/base/hash.h"
#include "common/interop/platform.h"

namespace mray::gltf {

/// Numbers for corners: those of one position with equal normals have the same.
class SmoothGroups {
public:
    /// For each vertex the group of those with its position and normal.
    std::vector<std::uint32_t> groups_of(std::span<const vec3> positions,
                                         std::span<const vec3> normals) {
        std::vector<std::uint32_t> groups(normals.size());
        for (std::size_t i = 0; i < groups.size(); ++i) {
            const vec3& p = positions[i];
            const vec3& n = normals[i];
            const Corner corner{bits(p.x), bits(p.y), bits(p.z), bits(n.x), bits(n.y), bits(n.z)};
            const auto next = static_cast<std::uint32_t>(numbers_.size());
            groups[i] = groups_.try_emplace(corner, next).first->second;
            if (groups[i] == next) numbers_.push_back(kNone);
        }
        return groups;
    }

    /// The number of a corner of a group: that of the first one, which is its own.
    std::uint32_t number_of(std::uint32_t group, std::uint32_t corner) {
        if (numbers_[group] == kNone) numbers_[group] = corner;
        return numbers_[group];
    }

private:
    struct Corner {
        std::uint32_t px, py, pz, nx, ny, nz;
        bool operator==(const Corner&) const = default;
    };
    struct CornerHash {
        std::size_t operator()(const Corner& corner) const {
            return static_cast<std::size_t>(hash_of(corner));
        }
    };
    /// Those of 0 for -0.
    static std::uint32_t bits(float x) { return std::bit_cast<std::uint32_t>(x + 0.0f); }

    static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
    std::unordered_map<Corner, std::uint32_t, CornerHash> groups_;
    std::vector<std::uint32_t> numbers_;
};

}  // namespace mray::gltf
