// The traversal of a packet. The including file defines PACKET_ON_GRID (whether rays are at the
// middles of pixels) and the functions that are declared here.
#ifndef SHADERS_PACKET_PACKET_TRAVERSAL_GLSL
#define SHADERS_PACKET_PACKET_TRAVERSAL_GLSL

#include "shaders/packet/deferred_rays.glsl"
#include "shaders/packet/triangle_setup.glsl"

const uint kAllTriangles = 0xFFFFu;

/// Tests a triangle against the rays of a group. `bit` is the triangle's bit in pending_deferred; 0
/// if there is no triangle, or if it surely misses them.
void trace_triangle(uint group, Setup s, uint name, uint bit);
/// Adds the error of the rays' own 1/z to q_error and sure_error.
void add_ray_error(inout Setup s);
/// The least 1/z that some of this lane's rays of a group have.
float least_q(uint group);

void update_depth() {
    packet_q = kDone;
    [[unroll]] for (uint g = 0u; g < kGroups; ++g) {
        group_q[g] = cluster_min(least_q(g));
        packet_q = lesser(packet_q, group_q[g]);
    }
}

/// The work of a traversal that is left besides the pending triangles: a node or a leaf, or
/// kEmptyChild; of a leaf, the triangles that are left.
struct Traversal {
    uint current;
    uint triangles;
    uint steps;
    uint most_steps;
};

/// kEmptyChild has kLeafBit set.
bool is_leaf(uint child) { return (child & kLeafBit) != 0u && child != kEmptyChild; }

bool is_finished(Traversal t) { return t.current == kEmptyChild && pending_count == 0u; }

/// For each group kLanes bits: the lanes whose pending triangle its rays may hit. Several groups
/// share a word.
const uint kMaskWords = (kGroups + kGroupVectors - 1u) / kGroupVectors;
uint group_lanes[kMaskWords];

/// Sets group_lanes; `groups` are those of this lane's triangle.
void find_group_lanes(uint groups) {
    [[unroll]] for (uint w = 0u; w < kMaskWords; ++w) {
        uint bits = 0u;
        [[unroll]] for (uint k = 0u; k < kGroupVectors; ++k) {
            bits |= (groups >> (kGroupVectors * w + k) & 1u) << (k * kLanes);
        }
        group_lanes[w] = cluster_or(bits << lane);
    }
}

uint lanes_of_group(uint group) {
    return group_lanes[group / kGroupVectors] >> (group % kGroupVectors * kLanes) &
           ((1u << kLanes) - 1u);
}

/// Traces the pending triangles of a group and of the group below it against both. Each such pair
/// has a loop of its own, since some devices jump over loops only, and not in the first iteration:
/// groups without triangles trace the first one, which surely misses, or whose error is too large
/// for a certain hit.
void trace_groups(uint group, Setup setup) {
    uint left = lanes_of_group(group) | lanes_of_group(group + 2u);
    do {
        // The index of the lowest bit; 0 if there is none.
        uint i = uint(bitCount(~left & (left - 1u))) & (kLanes - 1u);
        Setup s = read_setup(setup, i);
        uint name = read_lane(pending_names, i);
        uint bit = left & (0u - left);
        trace_triangle(group, s, name, bit);
        trace_triangle(group + 2u, s, name, bit);
        left &= left - 1u;
    } while (left != 0u);
}

/// Adds triangles of leaves to the pending ones until these are enough or a node is next. Sets
/// `rest` to the triangles of the last leaf that are left.
void gather_triangles(inout Traversal t, inout uint rest, bool has_room) {
    do {
        // Mostly true in the first iteration, but see cluster.glsl.
        if (is_leaf(t.current) && pending_count < kEnough && rest == 0u && has_room) {
            uint leaf = t.current & ~kLeafBit;
            rest = append_triangles(leaf, cull_leaf(leaf, PACKET_ON_GRID) & t.triangles);
            t.triangles = rest != 0u ? rest : kAllTriangles;
            if (rest == 0u) t.current = take_child(t.steps);
        }
        ++t.steps;
    } while (is_leaf(t.current) && pending_count < kEnough && rest == 0u && has_room);
}

void trace_pending(inout uint steps) {
    Setup setup = set_up_triangle(pending_triangle, pending_error);
    uint groups = pending_groups & met_groups(setup, PACKET_ON_GRID);
    leave_to_rule(setup);
    setup.q_error = pending_groups != 0u ? setup.q_error : kDone;
    setup.sure_error = pending_groups != 0u ? setup.sure_error : kDone;
    add_ray_error(setup);
    find_group_lanes(groups);
    steps += 2u + kGroups;
    [[unroll]] for (uint w = 0u; w < kMaskWords; ++w) steps += uint(bitCount(group_lanes[w]));
    trace_groups(0u, setup);
    trace_groups(1u, setup);
    if (kGroups > 4u) {
        trace_groups(4u, setup);
        trace_groups(5u, setup);
    }
    uint rest = queue_deferred(steps);
    pending_groups = (rest >> lane & 1u) != 0u ? pending_groups : 0u;
    pending_count = rest == 0u ? 0u : pending_count;
    update_depth();
}

/// Continues until nothing is left, the queue of deferred pairs is full, or steps are used up. Few
/// triangles wait for those of the next leaves.
void traverse(inout Traversal t) {
    bool has_room = true;
    do {
        uint rest = 0u;
        do {
            do {
                if ((t.current & kLeafBit) == 0u) {
                    visit_node(t.current);
                    t.current = take_child(t.steps);
                }
                ++t.steps;
            } while ((t.current & kLeafBit) == 0u && level <= kMaxDepth);
            gather_triangles(t, rest, true);
            ++t.steps;
        } while ((t.current & kLeafBit) == 0u && pending_count < kEnough &&
                 t.steps < t.most_steps && level <= kMaxDepth);
        do {
            trace_pending(t.steps);
            has_room = has_room_for_deferred();
            rest = 0u;
            gather_triangles(t, rest, has_room);
        } while ((is_leaf(t.current) || (pending_count != 0u && t.current == kEmptyChild)) &&
                 has_room && t.steps < t.most_steps);
    } while (!is_finished(t) && has_room && t.steps < t.most_steps && level <= kMaxDepth);
}

#endif  // SHADERS_PACKET_PACKET_TRAVERSAL_GLSL
