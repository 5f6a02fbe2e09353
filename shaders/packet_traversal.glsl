// The walk of a packet through the tree. Whoever includes this defines PACKET_ON_GRID, whether the
// rays are the middles of pixels, and the functions that are declared here.
#ifndef SHADERS_PACKET_TRAVERSAL_GLSL
#define SHADERS_PACKET_TRAVERSAL_GLSL

#include "shaders/packet_doubts.glsl"

const uint kAllTriangles = 0xFFFFu;

/// A triangle against the rays of a group. `bit` is the triangle's in pending_doubts; 0: there is
/// none.
void trace_triangle(uint group, Setup s, uint name, uint bit);
/// The least 1/z that matters to some ray.
float least_q();

/// What a traversal has still to do besides the pending triangles: a node or leaf, kEmptyChild if
/// there is none; of a leaf only some triangles.
struct Traversal {
    uint current;
    uint triangles;
    uint steps;
    uint most_steps;
};

/// kEmptyChild has kLeafBit set.
bool is_leaf(uint child) { return (child & kLeafBit) != 0u && child != kEmptyChild; }

bool is_finished(Traversal t) { return t.current == kEmptyChild && pending_count == 0u; }

/// The pending triangles that concern a group. A loop for each group, since it is all that some
/// devices jump over.
void trace_group(uint group, Setup setup, inout uint steps) {
    uint left = cluster_or((pending_groups >> group & 1u) << lane);
    do {
        uint i = uint(findLSB(left)) & (kLanes - 1u);
        trace_triangle(group, read_setup(setup, i), read_lane(pending_names, i),
                       left & (0u - left));
        left &= left - 1u;
        ++steps;
    } while (left != 0u);
}

/// Continues until there is nothing left, no room for doubts, or no steps.
void traverse(inout Traversal t) {
    bool has_room = true;
    do {
        do {
            if ((t.current & kLeafBit) == 0u) {
                visit_node(t.current);
                t.current = take_child(t.steps);
            }
            ++t.steps;
        } while ((t.current & kLeafBit) == 0u && level <= kMaxDepth);
        do {
            uint rest = 0u;
            do {
                // Always so in the first round of most, but see cluster.glsl.
                if (is_leaf(t.current) && pending_count < kEnough && rest == 0u) {
                    uint leaf = t.current & ~kLeafBit;
                    rest = append_triangles(leaf, cull_leaf(leaf, PACKET_ON_GRID) & t.triangles);
                    t.triangles = rest != 0u ? rest : kAllTriangles;
                    if (rest == 0u) t.current = take_child(t.steps);
                }
                ++t.steps;
            } while (is_leaf(t.current) && pending_count < kEnough && rest == 0u);
            Setup setup = set_up_triangle(pending_corners, pending_error);
            setup.win_error = pending_groups != 0u ? setup.win_error : kDone;
            t.steps += 2u;
            trace_group(0u, setup, t.steps);
            trace_group(1u, setup, t.steps);
            trace_group(2u, setup, t.steps);
            trace_group(3u, setup, t.steps);
            if (kGroups > 4u) {
                trace_group(4u, setup, t.steps);
                trace_group(5u, setup, t.steps);
                trace_group(6u, setup, t.steps);
                trace_group(7u, setup, t.steps);
            }
            uint open = queue_doubts(t.steps);
            has_room = has_room_for_doubts();
            pending_groups = (open >> lane & 1u) != 0u ? pending_groups : 0u;
            pending_count = open == 0u ? 0u : pending_count;
            packet_q = least_q();
        } while ((is_leaf(t.current) || pending_count != 0u) && has_room &&
                 t.steps < t.most_steps);
    } while (t.current != kEmptyChild && has_room && t.steps < t.most_steps && level <= kMaxDepth);
}

#endif  // SHADERS_PACKET_TRAVERSAL_GLSL
