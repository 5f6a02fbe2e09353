// The walk of a packet through the tree. Whoever includes this defines PACKET_ON_GRID, whether the
// rays are the middles of pixels, and the functions that are declared here.
#ifndef SHADERS_PACKET_TRAVERSAL_GLSL
#define SHADERS_PACKET_TRAVERSAL_GLSL

#include "shaders/packet_leaf.glsl"

const uint kAllTriangles = 0xFFFFu;

/// One triangle against all rays. The vectors of this lane's rays that are in doubt, as bits.
uint trace_triangle(Setup s, uint name);
/// Notes a doubt, if there is one. Whether all lanes have room for one more.
bool note_doubt(uint name, uint vectors);
/// The least 1/z that matters to some ray.
float least_q();

/// What a traversal has still to do: a node or leaf, kEmptyChild at the end; of a leaf only some
/// triangles.
struct Traversal {
    uint current;
    uint triangles;
    uint steps;
};

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
                uint left = cluster_or(chunk.is_used ? 1u << lane : 0u);
                do {
                    uint doubtful = 0u;
                    uint name = 0u;
                    do {
                        uint i = uint(findLSB(left)) & (kLanes - 1u);
                        if (left != 0u) {
                            name = triangle_name(leaf, read_lane(chunk.triangle, i));
                            doubtful = trace_triangle(read_setup(chunk.setup, i), name);
                        }
                        left &= left - 1u;
                        ++t.steps;
                    } while (left != 0u && cluster_or(doubtful) == 0u);
                    has_room = note_doubt(name, doubtful);
                    ++t.steps;
                } while (left != 0u && has_room);
                bool is_done = chunk.is_used && (left >> lane & 1u) == 0u;
                alive &= ~cluster_or(is_done ? 1u << chunk.triangle : 0u);
            } while (alive != 0u && has_room);
            if (is_visited && alive == 0u) {
                packet_q = least_q();
                t.current = take_child(t.steps);
            }
            t.triangles = alive != 0u ? alive : kAllTriangles;
        } while ((t.current & kLeafBit) != 0u && t.current != kEmptyChild && has_room &&
                 t.steps < kSteps);
    } while (t.current != kEmptyChild && has_room && t.steps < kSteps && level <= kMaxDepth);
}

#endif  // SHADERS_PACKET_TRAVERSAL_GLSL
