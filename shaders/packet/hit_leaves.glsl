// Candidates of a packet get t, u and v.
#ifndef SHADERS_PACKET_HIT_LEAVES_GLSL
#define SHADERS_PACKET_HIT_LEAVES_GLSL

#include "common/interop/hit_rule.h"

/// What the rule finds where a ray goes through a triangle for certain, in front of the origin: the
/// hit of its plain path, to the bit. False where the rule may not take that path; then it has to
/// be asked.
///
/// Plain edge functions have the signs of the accurate ones if they are beyond their bound, and the
/// accurate ones are known to be alike, so that magnitudes are all there is to test
/// (surely_inside). The bound is that of fast_edges, larger by 2^-16 to make up for roundings, 35 *
/// 2^-24 at most (proofs/fast_hits.g). All z have one sign where their range is less than their size
/// (weighted_hit). scaled_weight() drops nothing, because such functions are beyond 2^-20 m^2, and
/// their sum is less than m^2.
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
    return lesser(abs(u), lesser(abs(v), abs(w))) > bound &&
           bound * greater(z_range, 1.0f) <= s.depth_slack * sum && z_range < z_size;
}

#endif  // SHADERS_PACKET_HIT_LEAVES_GLSL
