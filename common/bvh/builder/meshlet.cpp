// Makes leaves.
#include <algorithm>
#include <cstring>

#include "common/bvh/builder/binary_tree.h"

namespace mray {
namespace {

/// Numbers vertices in the order in which they are added first. A hash table that does not branch
/// on whether a vertex is new, which cannot be predicted.
class VertexSet {
public:
    VertexSet() { std::fill_n(slots_, kTableSize, kNoSlot); }

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

// The memory of as many refs holds a whole LeafShape, that of fewer the used part.
constexpr std::size_t kRoomy = (sizeof(LeafShape) + sizeof(PrimRef) - 1) / sizeof(PrimRef);

constexpr std::size_t kWord = sizeof(std::uint32_t);
static_assert(kWord * (1 + 1 + 3) <= sizeof(PrimRef));

}  // namespace

bool find_leaf_shape(const Topology& topology, std::span<const std::uint32_t> prim_ids,
                     LeafShape& shape) {
    const auto count = static_cast<std::uint32_t>(prim_ids.size());
    VertexSet set;
    for (std::uint32_t i = 0; i < count; ++i) {
        const uvec3 t = topology.triangles[prim_ids[i]];
        const std::uint32_t a = set.add(t.x);
        const std::uint32_t b = set.add(t.y);
        const std::uint32_t c = set.add(t.z);
        if (set.vertices().size() > kLeafVertices) return false;
        shape.corners[i] = pack_corners(a, b, c, count);
    }
    const std::span<const std::uint32_t> vertices = set.vertices();
    shape.vertex_count = static_cast<std::uint32_t>(vertices.size());
    std::copy(vertices.begin(), vertices.end(), shape.vertices);
    return true;
}

void fill_leaf(const LeafShape& shape, std::span<const std::uint32_t> prim_ids,
               std::span<const vec3> positions, Leaf& leaf, std::uint32_t* leaf_vertices) {
    const auto count = static_cast<std::uint32_t>(prim_ids.size());
    for (std::uint32_t i = 0; i < kLeafTriangles; ++i) {
        const bool used = i < count;
        leaf.prim_id[i] = used ? prim_ids[i] : kNoPrim;
        leaf.vertex[i].corners = used ? shape.corners[i] : pack_corners(0, 0, 0, count);
    }
    for (std::uint32_t slot = 0; slot < kLeafVertices; ++slot) {
        const std::uint32_t vertex = shape.vertices[slot < shape.vertex_count ? slot : 0];
        leaf_vertices[slot] = vertex;
        leaf.vertex[slot].x = positions[vertex].x;
        leaf.vertex[slot].y = positions[vertex].y;
        leaf.vertex[slot].z = positions[vertex].z;
    }
}

LeafShape BinaryTree::shape(const BinaryNode& leaf) const {
    const char* room = reinterpret_cast<const char*>(&refs[leaf.begin]);
    LeafShape shape;
    if (leaf.size() >= kRoomy) {
        std::memcpy(&shape, room, sizeof shape);
        return shape;
    }
    const std::size_t corners = kWord * leaf.size();
    std::memcpy(&shape.vertex_count, room, kWord);
    std::memcpy(shape.corners, room + kWord, corners);
    std::memcpy(shape.vertices, room + kWord + corners, kWord * shape.vertex_count);
    return shape;
}

void BinaryTree::set_shape(const BinaryNode& leaf, const LeafShape& shape) {
    char* room = reinterpret_cast<char*>(&refs[leaf.begin]);
    if (leaf.size() >= kRoomy) {
        std::memcpy(room, &shape, sizeof shape);
        return;
    }
    const std::size_t corners = kWord * leaf.size();
    std::memcpy(room, &shape.vertex_count, kWord);
    std::memcpy(room + kWord, shape.corners, corners);
    std::memcpy(room + kWord + corners, shape.vertices, kWord * shape.vertex_count);
}

}  // namespace mray
