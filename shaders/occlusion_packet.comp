// Ambient occlusion: up to 16 rays of a pixel, which all start at one point, a pixel a cluster of
// lanes. Lanes are in turn a node's children, a leaf's vertices and triangles, and rays; a node is
// fetched once for all rays that meet it, and then tested against one of them after the other.
//
// Boxes are those of the slab test, bit for bit. Triangles are sorted by edge functions of vertices
// relative to the common point into those that a ray misses or hits for certain and those in
// doubt, which the rule is asked for, one of each lane at a time.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "shaders/exact.glsl"

#include "shaders/cluster.glsl"
#include "shaders/pixel_surface.glsl"
#include "shaders/spread.glsl"
#include "shaders/work.glsl"
#include "common/interop/triangle.h"

layout(local_size_x = kGroupSize) in;
layout(constant_id = kConstantStepBudget) const uint kSteps = kPacketStepBudget;
layout(constant_id = kConstantPacketRun) const uint kRun = 1u;

layout(push_constant) uniform Arguments { OcclusionArguments args; };
layout(binding = kBindNodes) uniform usamplerBuffer nodes;
layout(binding = kBindLeaves) uniform usamplerBuffer leaves;
layout(binding = kBindSeen) uniform usamplerBuffer seen;
layout(std430, binding = kBindHits) readonly buffer Hits { uvec4 hits[]; };
layout(std430, binding = kBindOcclusion) buffer Occlusion { uint occlusion[]; };

/// The rays of the pixel: lane l has those of numbers l, l + kLanes, ...
vec3 org;
vec3 dirs[kSlots];
vec3 rdirs[kSlots];
float tfars[kSlots];
/// Rays that have not been found to be occluded, as bits.
uint alive;
/// The pixel, among those of the region.
uint pixel_index;

vec3 read_ray(vec3 values[kSlots], uint ray) {
    vec3 v = read_lane(values[0], ray & (kLanes - 1u));
    [[unroll]] for (uint k = 1u; k < kSlots; ++k) {
        vec3 other = read_lane(values[k], ray & (kLanes - 1u));
        v = ray / kLanes == k ? other : v;
    }
    return v;
}

float read_ray(float values[kSlots], uint ray) {
    float v = read_lane(values[0], ray & (kLanes - 1u));
    [[unroll]] for (uint k = 1u; k < kSlots; ++k) {
        float other = read_lane(values[k], ray & (kLanes - 1u));
        v = ray / kLanes == k ? other : v;
    }
    return v;
}

void make_rays(uint index) {
    pixel_index = texelFetch(seen, int(index)).x;
    uint x = args.x + pixel_index % args.width;
    uint y = args.y + pixel_index / args.width;
    uvec4 words = hits[pixel_index];
    Hit hit;
    hit.t = uintBitsToFloat(words.x);
    hit.u = uintBitsToFloat(words.y);
    hit.v = uintBitsToFloat(words.z);
    hit.prim_id = words.w;
    Surface s = pixel_surface(camera_ray(args.params.camera, x, y), hit,
                              scene_triangle(hit.prim_id));
    uint own = 0u;
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        uint number = k * kLanes + lane;
        Ray ray = ao_ray(s, x, y, args.sample_index + number, args.params.ao_tfar);
        org = ray.org;
        dirs[k] = ray.dir;
        tfars[k] = ray.tfar;
        rdirs[k] = vec3(slab_reciprocal(ray.dir.x), slab_reciprocal(ray.dir.y),
                        slab_reciprocal(ray.dir.z));
        own |= args.sample_index + number < args.params.ao_count ? 1u << number : 0u;
    }
    alive = cluster_or(own);
}

/// The node that was visited last, and for each child of this lane the rays that meet it and have
/// not been there; and the same of the nodes above it.
uint node;
uint children[kSlots];
uint waiting[kSlots];
const uint kMaskWords = (kSlots + 1u) / 2u;
uint level;
uint level_nodes[kMaxDepth + 1u];
uint level_masks[kMaskWords * (kMaxDepth + 1u)];

void fetch_children() {
    uvec4 child = texelFetch(nodes, int(node * kNodeVec4s + kNodeChild + (lane & 3u)));
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        uint own = kLanes == 4u ? k : (lane >> 2u) * kSlots + k;
        children[k] = own < 2u ? (own == 0u ? child.x : child.y) : (own == 2u ? child.z : child.w);
    }
}

void push_level() {
    uint any = 0u;
    level_nodes[level] = node;
    [[unroll]] for (uint w = 0u; w < kMaskWords; ++w) {
        uint upper = kSlots > 1u ? waiting[min(2u * w + 1u, kSlots - 1u)] : 0u;
        uint words = waiting[2u * w] | upper << 16u;
        level_masks[level * kMaskWords + w] = words;
        any |= words;
    }
    level += cluster_or(any) != 0u ? 1u : 0u;
}

void pop_level() {
    --level;
    node = level_nodes[level];
    [[unroll]] for (uint w = 0u; w < kMaskWords; ++w) {
        uint words = level_masks[level * kMaskWords + w];
        waiting[2u * w] = words & 0xFFFFu;
        if (kSlots > 1u) waiting[min(2u * w + 1u, kSlots - 1u)] = words >> 16u;
    }
    fetch_children();
}

/// What to visit next, a node or leaf or kEmptyChild, and which rays go there.
uint current;
uint current_rays;

/// The child that most rays meet: boxes around the point come first.
void take_child(inout uint steps) {
    current = kEmptyChild;
    bool more = true;
    do {
        uint best = 0u;
        [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
            waiting[k] &= alive;
            uint key = waiting[k] << 8u | k << 4u | lane;
            best = max(best, waiting[k] != 0u ? key : 0u);
        }
        best = cluster_max(best);
        if (best != 0u) {
            uint owner = best & 15u;
            uint slot = best >> 4u & 15u;
            uint child = children[0];
            uint rays = waiting[0];
            [[unroll]] for (uint k = 1u; k < kSlots; ++k) {
                child = slot == k ? children[k] : child;
                rays = slot == k ? waiting[k] : rays;
            }
            current = read_lane(child, owner);
            current_rays = read_lane(rays, owner);
            [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
                waiting[k] = slot == k && lane == owner ? 0u : waiting[k];
            }
            more = false;
        } else if (level > 0u) {
            pop_level();
        } else {
            more = false;
        }
        ++steps;
    } while (more);
}

/// Of four, the one that this lane has in slot k.
float own_plane(vec4 v, uint k) {
    uint own = kLanes == 4u ? k : (lane >> 2u) * kSlots + k;
    return own < 2u ? (own == 0u ? v.x : v.y) : (own == 2u ? v.z : v.w);
}

/// Of one axis, the planes of this lane's boxes relative to the point, dilated as in slab_ray.
void fetch_planes(uint offset, float org_lower, float org_upper, out float lower[kSlots],
                  out float upper[kSlots]) {
    uint at = node * kNodeVec4s + offset + (lane & 3u);
    if (kLanes == 8u) {
        // One half fetches the lower planes, the other the upper ones, and they swap two each.
        bool is_upper = lane >= 4u;
        precise vec4 v = uintBitsToFloat(texelFetch(nodes, int(is_upper ? at + 4u : at))) -
                         vec4(is_upper ? org_upper : org_lower);
        vec2 other = subgroupShuffleXor(is_upper ? v.xy : v.zw, 4u);
        lower[0] = is_upper ? other.x : v.x;
        lower[kSlots - 1u] = is_upper ? other.y : v.y;
        upper[0] = is_upper ? v.z : other.x;
        upper[kSlots - 1u] = is_upper ? v.w : other.y;
        return;
    }
    precise vec4 l = uintBitsToFloat(texelFetch(nodes, int(at))) - vec4(org_lower);
    precise vec4 u = uintBitsToFloat(texelFetch(nodes, int(at + 4u))) - vec4(org_upper);
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        lower[k] = own_plane(l, k);
        upper[k] = own_plane(u, k);
    }
}

void visit_node(inout uint steps) {
    push_level();
    node = current;
    fetch_children();
    float d = box_dilation(org);
    precise vec3 org_lower = org + vec3(d);
    precise vec3 org_upper = org - vec3(d);
    float lower_x[kSlots], upper_x[kSlots];
    float lower_y[kSlots], upper_y[kSlots];
    float lower_z[kSlots], upper_z[kSlots];
    fetch_planes(kNodeLowerX, org_lower.x, org_upper.x, lower_x, upper_x);
    fetch_planes(kNodeLowerY, org_lower.y, org_upper.y, lower_y, upper_y);
    fetch_planes(kNodeLowerZ, org_lower.z, org_upper.z, lower_z, upper_z);
    uint met[kSlots];
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) met[k] = 0u;
    uint left = current_rays;
    do {
        uint r = uint(findLSB(left)) & 15u;
        vec3 rdir = read_ray(rdirs, r);
        float tfar = read_ray(tfars, r);
        [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
            precise float lx = lower_x[k] * rdir.x;
            precise float ux = upper_x[k] * rdir.x;
            precise float ly = lower_y[k] * rdir.y;
            precise float uy = upper_y[k] * rdir.y;
            precise float lz = lower_z[k] * rdir.z;
            precise float uz = upper_z[k] * rdir.z;
            // The nearer plane is that of the lesser distance, boxes that are empty aside.
            float enter = greater(greater(lesser(lx, ux), lesser(ly, uy)),
                                  greater(lesser(lz, uz), 0.0f));
            float leave = lesser(lesser(greater(lx, ux), greater(ly, uy)),
                                 lesser(greater(lz, uz), tfar));
            met[k] |= enter <= leave ? 1u << r : 0u;
        }
        left &= left - 1u;
        ++steps;
    } while (left != 0u);
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        waiting[k] = children[k] == kEmptyChild ? 0u : met[k];
    }
}

/// Where floats leave a doubt: triangles and rays, a pair a lane, on the first doubt_count lanes.
uint doubt_name;
uint doubt_ray;
uint doubt_count;
/// Rays in doubt about this lane's triangles of a leaf that no lane has taken yet; none if there is
/// room.
uint doubtful_leaf;
uint doubtful[kSlots];

bool has_room() { return doubt_count < kLanes; }

float least(vec3 v) { return lesser(v.x, lesser(v.y, v.z)); }
float sum_of(vec3 v) { return abs(v.x) + abs(v.y) + abs(v.z); }

/// In place of coordinates that are not finite.
const float kFarAway = 1.0e30f;

struct Facing {
    // Edge functions of a direction d are d.n, positive inside for rays from the side of the point.
    vec3 n0;
    vec3 n1;
    vec3 n2;
    /// Least and largest coordinates relative to the point.
    vec3 lower;
    vec3 upper;
    /// What is certain of an edge function beyond.
    float bound;
    bool is_usable;
    /// Whether the point is certainly not in the triangle's plane.
    bool has_side;
};

vec3 corners_of(vec3 vertices[kSlots], uint slot) {
    uint from = slot & (kLanes - 1u);
    vec3 v = read_lane(vertices[0], from);
    [[unroll]] for (uint h = 1u; h < kSlots; ++h) {
        vec3 other = read_lane(vertices[h], from);
        v = slot / kLanes == h ? other : v;
    }
    return v;
}

/// With s the largest |x| + |y| + |z| of the vertices a, b, c relative to the point: d.(b x c) is
/// dir.z times the edge function of the rule, in exact arithmetic. Its own roundings, those of a, b
/// and c, and what the rule displaces vertices by move it by less than 2^-17 s^2 each way, for
/// directions below 2 in each component; 2^-16 are taken. Likewise a.N, N = (b - a) x (c - a), is
/// the distance from the plane times |N|, and 2^-15 s |b - a| |c - a| is 8 times what displacements
/// and roundings can make of a point in the plane.
Facing facing_of(vec3 vertices[kSlots], uint words, bool is_triangle) {
    vec3 a = corners_of(vertices, corner(words, 0u));
    vec3 b = corners_of(vertices, corner(words, 1u));
    vec3 c = corners_of(vertices, corner(words, 2u));
    float size = greater(sum_of(a), greater(sum_of(b), sum_of(c)));
    vec3 e = b - a;
    vec3 f = c - a;
    float volume = dot(a, cross(e, f));
    float side = volume < 0.0f ? -1.0f : 1.0f;
    Facing t;
    t.n0 = side * cross(b, c);
    t.n1 = side * cross(c, a);
    t.n2 = side * cross(a, b);
    t.lower = min(a, min(b, c));
    t.upper = max(a, max(b, c));
    // 2^-16 and 2^-15.
    t.bound = 1.52587890625e-05f * size * size;
    t.has_side = abs(volume) > 3.0517578125e-05f * size * sum_of(e) * sum_of(f);
    t.is_usable = is_triangle && size < kFarAway;
    return t;
}

void visit_leaf(inout uint steps) {
    uint leaf = current & ~kLeafBit;
    vec3 vertices[kSlots];
    uint words[kSlots];
    [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
        uvec4 texel = texelFetch(leaves, int(leaf * kLeafVec4s + h * kLanes + lane));
        vec3 v = uintBitsToFloat(texel.xyz);
        precise vec3 relative = v - org;
        vertices[h] = v.x <= kSceneExtent ? relative : vec3(kFarAway);
        words[h] = texel.w;
    }
    Facing triangles[kSlots];
    uint sure = 0u;
    doubtful_leaf = leaf;
    [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
        bool is_triangle = h * kLanes + lane < corner_triangle_count(words[h]);
        triangles[h] = facing_of(vertices, words[h], is_triangle);
        doubtful[h] = 0u;
    }
    uint left = current_rays & alive;
    do {
        uint r = uint(findLSB(left)) & 15u;
        vec3 d = read_ray(dirs, r);
        float tfar = read_ray(tfars, r);
        vec3 sizes = abs(d);
        bool is_x = sizes.x >= sizes.y && sizes.x >= sizes.z;
        bool is_y = !is_x && sizes.y >= sizes.z;
        float dz = is_x ? d.x : is_y ? d.y : d.z;
        float reach = tfar * abs(dz);
        [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
            float e0 = dot(d, triangles[h].n0);
            float e1 = dot(d, triangles[h].n1);
            float e2 = dot(d, triangles[h].n2);
            float low = lesser(e0, lesser(e1, e2));
            float high = greater(e0, greater(e1, e2));
            float lower = is_x   ? triangles[h].lower.x
                          : is_y ? triangles[h].lower.y
                                 : triangles[h].lower.z;
            float upper = is_x   ? triangles[h].upper.x
                          : is_y ? triangles[h].upper.y
                                 : triangles[h].upper.z;
            float nearest = dz < 0.0f ? -upper : lower;
            float farthest = dz < 0.0f ? -lower : upper;
            float bound = triangles[h].bound;
            // A hit has a depth between those of the vertices.
            bool may_hit = triangles[h].is_usable && farthest > 0.0f &&
                           nearest <= 1.0001f * reach &&
                           (low >= -8.0f * bound ||
                            (!triangles[h].has_side && high <= 8.0f * bound));
            bool does_hit = may_hit && triangles[h].has_side && low > bound &&
                            nearest >= farthest - nearest && farthest <= 0.9999f * reach;
            sure |= does_hit ? 1u << r : 0u;
            doubtful[h] |= may_hit && !does_hit ? 1u << r : 0u;
        }
        left &= left - 1u;
        ++steps;
    } while (left != 0u);
    alive &= ~cluster_or(sure);
}

vec3 leaf_vertex(uint leaf_at, uint slot) {
    return uintBitsToFloat(texelFetch(leaves, int(leaf_at + slot)).xyz);
}

/// The rule for the doubts, one of each lane.
void settle_doubts() {
    bool is_any = lane < doubt_count;
    uint name = is_any ? doubt_name : 0u;
    uint at = (name >> 4u) * kLeafVec4s;
    uint corners = texelFetch(leaves, int(at + (name & 15u))).w;
    TriangleHit hit;
    bool is_hit = intersect_triangle(
        shear_ray(org, read_ray(dirs, doubt_ray)), 0.0f, read_ray(tfars, doubt_ray),
        leaf_vertex(at, corner(corners, 0u)), leaf_vertex(at, corner(corners, 1u)),
        leaf_vertex(at, corner(corners, 2u)), hit);
    alive &= ~cluster_or(is_any && is_hit ? 1u << doubt_ray : 0u);
    doubt_count = 0u;
}

/// Hands what is doubtful to lanes, one pair after the other, as long as there is room.
void note_doubts(inout uint steps) {
    bool more = true;
    do {
        uint own = 0u;
        uint slot = 0u;
        [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
            doubtful[h] &= alive;
            slot = own == 0u ? h : slot;
            own = own == 0u ? doubtful[h] : own;
        }
        uint lanes = cluster_or(own != 0u ? 1u << lane : 0u);
        bool is_any = lanes != 0u && has_room();
        uint from = uint(findLSB(lanes)) & (kLanes - 1u);
        uint ray = uint(findLSB(read_lane(own, from))) & 15u;
        uint name = doubtful_leaf * 16u + read_lane(slot, from) * kLanes + from;
        bool is_taker = is_any && lane == doubt_count;
        doubt_name = is_taker ? name : doubt_name;
        doubt_ray = is_taker ? ray : doubt_ray;
        uint any = 0u;
        [[unroll]] for (uint h = 0u; h < kSlots; ++h) {
            bool is_given = is_any && lane == from && h == slot;
            doubtful[h] = is_given ? doubtful[h] & (doubtful[h] - 1u) : doubtful[h];
            any |= doubtful[h];
        }
        doubt_count += is_any ? 1u : 0u;
        more = cluster_or(any) != 0u;
        ++steps;
    } while (more && has_room());
}

void trace(inout uint steps) {
    level = 0u;
    current = 0u;
    current_rays = alive;
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) waiting[k] = 0u;
    [[unroll]] for (uint h = 0u; h < kSlots; ++h) doubtful[h] = 0u;
    doubt_count = 0u;
    node = 0u;
    do {
        do {
            // kEmptyChild has kLeafBit set.
            do {
                if ((current & kLeafBit) == 0u) {
                    visit_node(steps);
                    take_child(steps);
                }
            } while ((current & kLeafBit) == 0u && level <= kMaxDepth);
            do {
                if ((current & kLeafBit) != 0u && current != kEmptyChild && has_room()) {
                    visit_leaf(steps);
                    note_doubts(steps);
                    take_child(steps);
                }
            } while ((current & kLeafBit) != 0u && current != kEmptyChild && has_room());
            steps += 2u;
        } while (current != kEmptyChild && has_room() && steps < kSteps);
        settle_doubts();
        note_doubts(steps);
    } while ((current != kEmptyChild || doubt_count != 0u) && steps < kSteps &&
             level <= kMaxDepth);
}

/// Rays that are left are traced by `resume`.
void leave_out() {
    [[unroll]] for (uint k = 0u; k < kSlots; ++k) {
        Ray ray;
        ray.org = org;
        ray.tnear = 0.0f;
        ray.dir = dirs[k];
        ray.tfar = tfars[k];
        if ((alive >> (k * kLanes + lane) & 1u) != 0u) suspend(ray, pixel_index);
    }
}

void main() {
    find_lane();
    uint group = spread_group(gl_WorkGroupID.x, gl_NumWorkGroups.x);
    uint cluster = group * (kGroupSize / kLanes) + gl_SubgroupID * (gl_SubgroupSize / kLanes) +
                   gl_SubgroupInvocationID / kLanes;
    uint at = args.seen_first + cluster * kRun;
    uint end = min(at + kRun, args.seen_end);
    if (at >= end) return;
    uint steps = 0u;
    do {
        make_rays(at);
        uint all = alive;
        if (steps < kSteps) trace(steps);
        bool is_complete = steps < kSteps && level <= kMaxDepth;
        uint count = uint(bitCount(all & ~alive));
        if (lane == 0u && count != 0u) occlusion[pixel_index] += count;
        if (!is_complete) leave_out();
        ++at;
    } while (at < end);
}
