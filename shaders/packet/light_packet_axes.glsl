// The plane of a light packet: the places of rays, and the axes.
#ifndef SHADERS_PACKET_LIGHT_PACKET_AXES_GLSL
#define SHADERS_PACKET_LIGHT_PACKET_AXES_GLSL

#include "shaders/packet/packet.glsl"

/// The place of a direction in the plane of a shear.
vec2 sheared_point(vec3 d, vec2 shear, float rz) {
    precise vec2 moved = d.xy - shear * d.z;
    return moved * rz;
}

/// Bound of the error in x or y of such a point, and of its dot products with plane_axes, given the
/// largest coordinate (proofs/packet_rays.g).
///
/// 1. Directions have components below 2, shears up to 1, z is at least 1/2. So the product is off
///    by 2^-24 and the point by 2^-23 for it, and by 2^-21 of itself for the difference, the
///    division (2.5 ulp) and the last product.
/// 2. Axes have a length of 1, so a dot product is off by sqrt(2) times as much, and by 2^-22 for
///    two products and a sum.
float point_error(float most) { return kPointError + kPointErrorOfPlace * most; }

/// Sums over the rays of a packet: points in the plane, pixels, and points times x and y of the
/// pixels.
struct PointSums {
    float count;
    vec2 points;
    vec2 pixels;
    vec2 by_x;
    vec2 by_y;
};

PointSums no_points() {
    return PointSums(0.0f, vec2(0.0f), vec2(0.0f), vec2(0.0f), vec2(0.0f));
}

/// Adds this lane's ray of vector v.
void add_point(inout PointSums sums, uint v, vec2 at, bool is_wanted) {
    uvec2 at_pixel = uvec2(4u * (v & 3u) + (lane & 3u), kVectorHeight * (v >> 2u) + (lane >> 2u));
    vec2 pixel = vec2(at_pixel) - 0.5f * vec2(kPacketWidth, PACKET_HEIGHT);
    vec2 point = is_wanted ? at : vec2(0.0f);
    sums.count += is_wanted ? 1.0f : 0.0f;
    sums.points += point;
    sums.pixels += is_wanted ? pixel : vec2(0.0f);
    sums.by_x += pixel.x * point;
    sums.by_y += pixel.y * point;
}

vec2 cluster_sum(vec2 v) {
    v += subgroupShuffleXor(v, 1u);
    v += subgroupShuffleXor(v, 2u);
    if (kLanes >= 8u) v += subgroupShuffleXor(v, 4u);
    if (kLanes >= 16u) v += subgroupShuffleXor(v, 8u);
    return v;
}

/// Two linear functions of the plane, of length 1: the first depends little on y of a pixel, the
/// second little on x, so that rectangles of pixels fill rectangles of the plane. If the two are
/// within 15 degrees of each other, an orthogonal pair along the packet's longer side.
mat2 plane_axes(PointSums own) {
    float count = greater(cluster_sum(vec2(own.count)).x, 1.0f);
    vec2 mean = cluster_sum(own.points) / count;
    vec2 pixels = cluster_sum(own.pixels);
    // The steps of a pixel in x and in y, times the variance of x; 8 rows have a quarter of it in
    // y.
    float ratio = PACKET_HEIGHT == 8u ? 4.0f : 1.0f;
    vec2 along_x = cluster_sum(own.by_x) - pixels.x * mean;
    vec2 along_y = ratio * (cluster_sum(own.by_y) - pixels.y * mean);
    float x2 = dot(along_x, along_x);
    float y2 = dot(along_y, along_y);
    float area = along_x.x * along_y.y - along_x.y * along_y.x;
    vec2 longer = ratio * x2 > y2 ? along_x : along_y;
    bool is_narrow = area * area < 0.0625f * x2 * y2;
    vec2 row_x = is_narrow ? longer : vec2(along_y.y, -along_y.x);
    vec2 row_y = is_narrow ? vec2(-longer.y, longer.x) : vec2(-along_x.y, along_x.x);
    row_x *= inversesqrt(dot(row_x, row_x));
    row_y *= inversesqrt(dot(row_y, row_y));
    bool is_known = lesser(x2, y2) > 1.0e-16f && greater(x2, y2) < 1.0e16f;
    return is_known ? mat2(row_x, row_y) : mat2(1.0f);
}

/// z of an axis moved by the shear, and its rounding error, which is less than 3 * 2^-25 of the
/// row. Only the reference vertex of a leaf uses the error; the bound of the others counts it among
/// the roundings of rows (packet_leaf.glsl).
vec2 sheared_axis(vec2 axis, vec2 shear) {
    precise float x = axis.x * shear.x;
    precise float y = axis.y * shear.y;
    precise float sum = x + y;
    float error = product_error(axis.x, shear.x, x) + product_error(axis.y, shear.y, y) +
                  difference_error(x, -y, sum);
    return vec2(-sum, -error);
}

#endif  // SHADERS_PACKET_LIGHT_PACKET_AXES_GLSL
