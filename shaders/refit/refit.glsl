// The refit of boxes, level by level from the leaves up (I. Wald, S. Boulos, P. Shirley. Ray
// Tracing Deformable Scenes Using Dynamic Bounding Volume Hierarchies. ACM TOG 26(1), 2007, section
// 4). A leaf or a node has 16 lanes, one for each vertex or child, which read and write memory in
// sequence; six of them reduce a plane each. An atomic climb would need one dispatch, but gives wrong
// boxes on devices whose device-scope barriers fail in non-uniform control flow.
layout(push_constant) uniform Arguments { RefitArguments args; };

WORDS(NodeWords, node_words, kBindNodeWords);

uint refit_lane() { return gl_LocalInvocationID.x % kRefitLanes; }

/// The leaf or node of the lane; only if is_within().
uint refit_item() { return args.first + gl_GlobalInvocationID.x / kRefitLanes; }

bool is_within() { return gl_GlobalInvocationID.x / kRefitLanes < args.count; }

/// The word of a slot's plane p: lower x, upper x, lower y, ...
uint plane_word(uint node, uint p, uint slot) { return 4u * kNodeVec4s * node + plane_at(p, slot); }

/// The boxes of all lanes, plane by plane. One more word a plane spreads them over banks of memory.
shared float lane_planes[6u * (kGroupSize + 1u)];
/// The boxes of the quarters of each leaf's or node's lanes, in the order of kBindQuarters.
const uint kQuarterWords = 4u * kQuarterVec4s;
shared float quarter_planes[kQuarterWords * kGroupSize / kRefitLanes];

uint lane_plane_at(uint p, uint lane) { return p * (kGroupSize + 1u) + lane; }
uint first_quarter_plane() { return gl_LocalInvocationID.x / kRefitLanes * kQuarterWords; }

/// Whether plane p is an upper one.
bool is_upper(uint p) { return (p & 1u) != 0u; }
float unite_planes(uint p, float a, float b) { return is_upper(p) ? max(a, b) : min(a, b); }

/// Unites the boxes of each four lanes. All lanes of a workgroup call it at once.
void unite_quarters(vec3 lower, vec3 upper) {
    float planes[6] = float[](lower.x, upper.x, lower.y, upper.y, lower.z, upper.z);
    for (uint p = 0u; p < 6u; ++p)
        lane_planes[lane_plane_at(p, gl_LocalInvocationID.x)] = planes[p];
    barrier();
    uint first_lane = gl_LocalInvocationID.x / kRefitLanes * kRefitLanes;
    for (uint word = refit_lane(); word < kQuarterWords; word += kRefitLanes) {
        uint p = word / 4u;
        uint at = lane_plane_at(p, first_lane + 4u * (word % 4u));
        float plane = lane_planes[at];
        for (uint i = 1u; i < 4u; ++i) plane = unite_planes(p, plane, lane_planes[at + i]);
        quarter_planes[first_quarter_plane() + word] = plane;
    }
    barrier();
}

/// After unite_quarters(): plane p of the union of the four.
float united_plane(uint p) {
    uint at = first_quarter_plane() + 4u * p;
    return unite_planes(p, unite_planes(p, quarter_planes[at], quarter_planes[at + 1u]),
                        unite_planes(p, quarter_planes[at + 2u], quarter_planes[at + 3u]));
}

/// Writes plane p of a box to its parent's slot.
void store_plane(uint parent, uint p, float value) {
    STORE_WORD(node_words, plane_word(parent_node(parent), p, parent_slot(parent)), value);
}
