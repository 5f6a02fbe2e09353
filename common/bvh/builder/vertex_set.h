// The different vertices of a few triangles.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "common/interop/bvh_layout.h"

namespace mray {

/// Numbers vertices in the order in which they are added first. A hash table that does not branch
/// on whether a vertex is new, which cannot be predicted. Holds the vertices of kLeafTriangles
/// triangles.
class VertexSet {
public:
    VertexSet() { std::fill_n(slots_, kTableSize, kNoSlot); }

    /// Returns the number of a vertex.
    std::uint32_t add(std::uint32_t vertex) {
        // Multiplicative hashing; 2^32 over the golden ratio.
        std::uint8_t& entry = slots_[(vertex * 0x9E3779B9u) >> (32 - kTableBits)];
        vertices_[size_] = vertex;
        std::uint32_t slot = std::min<std::uint32_t>(entry, size_);
        if (vertices_[slot] != vertex) [[unlikely]] {
            // The entry belongs to another vertex. The number of this one is at most size_.
            slot = 0;
            while (vertices_[slot] != vertex) ++slot;
        }
        entry = static_cast<std::uint8_t>(slot);
        size_ += slot == size_ ? 1 : 0;
        return slot;
    }
    std::span<const std::uint32_t> vertices() const { return {vertices_, size_}; }

private:
    static constexpr std::uint32_t kCapacity = 3 * kLeafTriangles;
    static constexpr std::uint8_t kNoSlot = kCapacity;
    static constexpr std::uint32_t kTableBits = 7;
    static constexpr std::uint32_t kTableSize = 1u << kTableBits;

    std::uint32_t vertices_[kCapacity + 1];
    std::uint32_t size_ = 0;
    std::uint8_t slots_[kTableSize];
};

}  // namespace mray
