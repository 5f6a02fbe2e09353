// The deferred pairs of a triangle and a ray that are uncertain. While triangles are traced, the
// pairs are bits; then they go to a queue, which the rule empties.
#ifndef SHADERS_PACKET_DEFERRED_RAYS_GLSL
#define SHADERS_PACKET_DEFERRED_RAYS_GLSL

#include "shaders/packet/packet_leaf.glsl"

/// For each group, kLanes bits for each of its vectors: the pending triangles that are uncertain
/// for this lane's ray.
uint pending_deferred[kGroups];

/// The queue: triangles, and for each the vectors of this lane's rays that are uncertain. The last
/// entry is 0 as long as there is room.
const uint kMaxDeferred = 4u;
uint deferred_names[kMaxDeferred];
uint deferred_vectors[kMaxDeferred];

void clear_pending() {
    pending_count = 0u;
    pending_groups = 0u;
    [[unroll]] for (uint g = 0u; g < kGroups; ++g) pending_deferred[g] = 0u;
    [[unroll]] for (uint i = 0u; i < kMaxDeferred; ++i) deferred_vectors[i] = 0u;
}

bool has_room_for_deferred() { return cluster_or(deferred_vectors[kMaxDeferred - 1u]) == 0u; }

void push_deferred(uint name, uint vectors) {
    [[unroll]] for (uint i = 1u; i < kMaxDeferred; ++i) {
        uint to = kMaxDeferred - i;
        deferred_names[to] = vectors != 0u ? deferred_names[to - 1u] : deferred_names[to];
        deferred_vectors[to] = vectors != 0u ? deferred_vectors[to - 1u] : deferred_vectors[to];
    }
    deferred_names[0] = vectors != 0u ? name : deferred_names[0];
    deferred_vectors[0] = vectors != 0u ? vectors : deferred_vectors[0];
}

/// Takes a vector from the queue. Leaves the queue as it is if it is empty or is_wanted is false.
uint pop_deferred(bool is_wanted, out uint name) {
    uint v = uint(findLSB(deferred_vectors[0])) & (kVectors - 1u);
    name = deferred_names[0];
    deferred_vectors[0] &= is_wanted ? deferred_vectors[0] - 1u : 0xFFFFFFFFu;
    bool is_next = deferred_vectors[0] == 0u;
    [[unroll]] for (uint i = 0u; i < kMaxDeferred - 1u; ++i) {
        deferred_names[i] = is_next ? deferred_names[i + 1u] : deferred_names[i];
        deferred_vectors[i] = is_next ? deferred_vectors[i + 1u] : deferred_vectors[i];
    }
    deferred_vectors[kMaxDeferred - 1u] = is_next ? 0u : deferred_vectors[kMaxDeferred - 1u];
    return v;
}

/// Moves the uncertain pairs of pending triangles to the queue, as long as there is room. Returns
/// the triangles with pairs that are left, as bits of lanes.
uint queue_deferred(inout uint steps) {
    uint rest = 0u;
    bool has_room = has_room_for_deferred();
    do {
        uint any = 0u;
        [[unroll]] for (uint g = 0u; g < kGroups; ++g) any |= pending_deferred[g];
        [[unroll]] for (uint k = 1u; k < kGroupVectors; ++k) any |= any >> (k * kLanes);
        uint i = uint(findLSB(any)) & (kLanes - 1u);
        uint vectors = 0u;
        rest = 0u;
        [[unroll]] for (uint g = 0u; g < kGroups; ++g) {
            [[unroll]] for (uint k = 0u; k < kGroupVectors; ++k) {
                // None without room: see cluster.glsl.
                uint bit = has_room ? 1u << (k * kLanes) << i : 0u;
                vectors |= (pending_deferred[g] & bit) != 0u ? 1u << vector_of(g, k) : 0u;
                pending_deferred[g] &= ~bit;
            }
            rest |= pending_deferred[g];
        }
        push_deferred(read_lane(pending_names, i), vectors);
        rest = cluster_or(rest);
        has_room = has_room_for_deferred();
        ++steps;
    } while (rest != 0u && has_room);
    [[unroll]] for (uint k = 1u; k < kGroupVectors; ++k) rest |= rest >> (k * kLanes);
    [[unroll]] for (uint g = 0u; g < kGroups; ++g) pending_deferred[g] = 0u;
    return rest & ((1u << kLanes) - 1u);
}

#endif  // SHADERS_PACKET_DEFERRED_RAYS_GLSL
