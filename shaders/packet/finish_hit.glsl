// Gives the closest candidates of a packet t, u and v.
#ifndef SHADERS_PACKET_FINISH_HIT_GLSL
#define SHADERS_PACKET_FINISH_HIT_GLSL

#include "common/interop/hit_rule.h"

/// The rule's hit of a ray that certainly goes through a triangle in front of its origin, by its
/// fast path and with its bits. Returns false if the rule may not take its fast path; then only the
/// exact rule gives the hit.
///
/// 1. Fast edge functions beyond their bound have the signs of the exact ones, which are known to
///    be equal. So testing magnitudes is enough (surely_inside).
/// 2. The bound is that of fast_edges, larger by 2^-16 for roundings, which are at most 35 * 2^-24
///    (proofs/fast_hits.g).
/// 3. The error that |z| must exceed is at least that of weighted_hit: depth_slack limits its part
///    by the bound, and the range is at most twice the size (proofs/fast_hits.g).
/// 4. scaled_weight() drops nothing, because such functions are beyond 2^-20 m^2, and their sum is
///    less than m^2.
bool finish_hit(ShearedRay s, vec3 a, vec3 b, vec3 c, out TriangleHit hit) {
    precise float u0 = b.x * c.y;
    precise float u1 = b.y * c.x;
    precise float v0 = c.x * a.y;
    precise float v1 = c.y * a.x;
    precise float w0 = a.x * b.y;
    precise float w1 = a.y * b.x;
    precise float u = u0 - u1;
    precise float v = v0 - v1;
    precise float w = w0 - w1;
    precise float sum = (abs(u) + abs(v)) + abs(w);
    float scale = rcp(sum);
    precise float wb = abs(v) * scale;
    precise float wc = abs(w) * scale;
    precise float rest = 1.0f - (wb + wc);
    float wa = greater(rest, 0.0f);
    precise float z = (wa * a.z + wb * b.z) + wc * c.z;
    precise float t = z * rcp(s.dir.z);
    hit = TriangleHit(t, wb, wc);

    float m = abs(a.x) + abs(a.y) + abs(b.x) + abs(b.y) + abs(c.x) + abs(c.y);
    float nearest = lesser(a.z, lesser(b.z, c.z));
    float farthest = greater(a.z, greater(b.z, c.z));
    precise float z_range = farthest - nearest;
    float z_size = greater(abs(nearest), abs(farthest));
    float r = kFastProjectionError * (2.0f * m + z_size) + kFastProjectionFloor;
    float bound = 1.0000152587890625f * r * (m + 2.0f * r);
    float error = 1.0000152587890625f *
                  (2.0f * s.depth_slack + (2.0f * kWeightRounding + kMeanRounding) * z_size);
    return lesser(abs(u), lesser(abs(v), abs(w))) > bound &&
           bound * greater(z_range, 1.0f) <= s.depth_slack * sum && abs(z) > error;
}

#endif  // SHADERS_PACKET_FINISH_HIT_GLSL
