// Winners of a packet get t, u and v.
#ifndef SHADERS_PACKET_WINNERS_GLSL
#define SHADERS_PACKET_WINNERS_GLSL

#include "common/interop/triangle.h"

/// What the rule finds where a ray goes through a triangle for certain, in front of the origin: the
/// hit of its plain path, to the bit. False where the rule may not take that path; then it has to
/// be asked.
///
/// Plain edge functions have the signs of the accurate ones if they are beyond their bound, and the
/// accurate ones are known to be alike, so that magnitudes are all there is to test
/// (surely_inside). The bound is that of fast_edges with z_size >= the largest |z| and z_range >=
/// the range of z (at most twice as large), and larger by 2^-16 to make up for roundings, which add
/// up to less than 16 * 2^-24. With m the sum of |x| + |y| it is more than 2^-20 m^2, and the edge
/// functions add up to less than m^2: their weights are neither 0 nor below 2^-21, so that
/// scaled_weight is a product.
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
    precise float divisor = sum * s.dir.z;
    float scale = rcp(divisor);
    precise float wa = abs(u) * scale;
    precise float wb = abs(v) * scale;
    precise float wc = abs(w) * scale;
    precise float t = (wa * a.z + wb * b.z) + wc * c.z;
    precise float hit_u = wb * s.dir.z;
    precise float hit_v = wc * s.dir.z;
    hit = TriangleHit(t, hit_u, hit_v);

    float m = abs(a.x) + abs(a.y) + abs(b.x) + abs(b.y) + abs(c.x) + abs(c.y);
    float z_range = abs(b.z - a.z) + abs(c.z - a.z);
    float z_size = abs(a.z) + z_range;
    float r = kFastProjectionError * (2.0f * m + z_size) + kFastProjectionFloor;
    float bound = 1.0000152587890625f * r * (m + 2.0f * r);
    return lesser(abs(u), lesser(abs(v), abs(w))) > bound &&
           bound * greater(z_range, 1.0f) <= s.depth_slack * sum;
}

#endif  // SHADERS_PACKET_WINNERS_GLSL
