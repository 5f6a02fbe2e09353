// The walk of a packet through the tree. Whoever includes this defines PACKET_ON_GRID, whether the
// rays are the middles of pixels, and the functions that are declared here.
#ifndef SHADERS_PACKET_TRAVERSAL_GLSL
#define SHADERS_PACKET_TRAVERSAL_GLSL

#include "shaders/packet_doubts.glsl"

const uint kAllTriangles = 0xFFFFu;

/// A triangle against the rays of a group. `bit` is the triangle's in chunk_doubts, 0: no triangle.
void trace_triangle(uint group, Setup s, uint name, uint bit);
/// The least 1/z that matters to some ray.
float least_q();

/// What a traversal has still to do: a node or leaf, kEmptyChild at the end; of a leaf only some
/// triangles.
struct Traversal {
    uint current;
    uint triangles;
    uint steps;
    uint most_steps;
};

/// The triangles of a chunk that concern a group. A loop for each group, since it is all that some
/// devices jump over.
void trace_group(uint group, uint leaf, Chunk chunk, inout uint steps) {
    uint left = cluster_or((chunk.groups >> group & 1u) << lane);
    do {
        uint i = uint(findLSB(left)) & (kLanes - 1u);
        uint name = triangle_name(leaf, read_lane(chunk.triangle, i));
        trace_triangle(group, read_setup(chunk.setup, i), name, left & (0u - left));
        left &= left - 1u;
        ++steps;
    } while (left != 0u);
}

/// Continues until there is nothing left, no room for doubts, or no steps.
void traverse(inout Traversal t) {
    bool has_room = true;
    do {
        // kEmptyChild has kLeafBit set.
        do {
            if ((t.current & kLeafBit) == 0u) {
                visit_node(t.current);
                t.current = take_child(t.steps);
            }
        } while ((t.current & kLeafBit) == 0u && level <= kMaxDepth);
        do {
            uint leaf = 0u;
            uint alive = 0u;
            do {
                bool is_leaf = t.current != kEmptyChild;
                leaf = is_leaf ? t.current & ~kLeafBit : 0u;
                alive = cull_leaf(leaf, PACKET_ON_GRID) & t.triangles;
                alive = is_leaf ? alive : 0u;
                t.triangles = kAllTriangles;
                if (alive == 0u && is_leaf) t.current = take_child(t.steps);
                ++t.steps;
            } while (alive == 0u && (t.current & kLeafBit) != 0u && t.current != kEmptyChild);
            bool is_visited = alive != 0u;
            do {
                Chunk chunk = set_up_chunk(alive);
                t.steps += 2u;
                trace_group(0u, leaf, chunk, t.steps);
                trace_group(1u, leaf, chunk, t.steps);
                trace_group(2u, leaf, chunk, t.steps);
                trace_group(3u, leaf, chunk, t.steps);
                if (kGroups > 4u) {
                    trace_group(4u, leaf, chunk, t.steps);
                    trace_group(5u, leaf, chunk, t.steps);
                    trace_group(6u, leaf, chunk, t.steps);
                    trace_group(7u, leaf, chunk, t.steps);
                }
                uint open = queue_doubts(leaf, chunk.triangle, t.steps);
                has_room = has_room_for_doubts();
                bool is_done = chunk.groups != 0u && (open >> lane & 1u) == 0u;
                alive &= ~cluster_or(is_done ? 1u << chunk.triangle : 0u);
            } while (alive != 0u && has_room);
            if (is_visited && alive == 0u) {
                packet_q = least_q();
                t.current = take_child(t.steps);
            }
            t.triangles = alive != 0u ? alive : kAllTriangles;
        } while ((t.current & kLeafBit) != 0u && t.current != kEmptyChild && has_room &&
                 t.steps < t.most_steps);
    } while (t.current != kEmptyChild && has_room && t.steps < t.most_steps && level <= kMaxDepth);
}

#endif  // SHADERS_PACKET_TRAVERSAL_GLSL
