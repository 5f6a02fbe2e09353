// Where the rays of a light packet go: the axes of their plane, and their places in it.

#if defined(MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_DIRECTIONS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_DIRECTIONS_INL_H
#undef MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_DIRECTIONS_INL_H
#else
#define MORPHRAY_CPU_PACKET_LIGHT_LIGHT_PACKET_DIRECTIONS_INL_H
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "cpu/packet/light/light_packet.h"
#include "cpu/simd/hit_rule-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {

/// The plane's unit is chosen so that |x| and |y| are at most this.
inline constexpr float kPlaneHalf = 0.5f * kLightPacketSide;

/// The least extent for which a unit is chosen: a packet of nearly parallel rays gets no tiny unit.
inline constexpr double kLeastPlaneExtent = 0x1p-16;

/// The unit for |x|, |y| up to `extent`, a power of two.
inline double plane_unit(double extent) {
    return std::exp2(std::ceil(std::log2(std::max(extent, kLeastPlaneExtent) / kPlaneHalf)));
}

/// Directions of some rays of a packet.
struct Samples {
    vec3 dirs[kLightPacketBlocks];
    std::size_t count = 0;
};

/// Takes the first ray of every step-th block, of blocks that have one.
HWY_INLINE void take_samples(const SharedOriginRays* rays, std::uint32_t squares,
                             std::uint32_t step, Samples& samples) {
    for (std::uint32_t block = 0; block < squares * kSquareBlocks; block += step) {
        for (std::uint32_t i = 0; i < kBlockRays; ++i) {
            if (!rays[block].has(i)) continue;
            samples.dirs[samples.count++] = rays[block].direction(i);
            break;
        }
    }
}

/// Sets axes[2] to a unit vector near all active directions, axes[0] and axes[1] to unit vectors
/// across it, and centre to axes[2] in floats. Returns false if the directions have no mean.
HWY_INLINE bool choose_axes(const Samples& samples, double axes[3][3], float centre[3]) {
    double sum[3] = {0, 0, 0};
    for (std::size_t i = 0; i < samples.count; ++i) {
        for (int axis = 0; axis < 3; ++axis) sum[axis] += samples.dirs[i][axis];
    }
    const double length = std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
    if (!(length > 0)) return false;
    double* mean = axes[2];
    for (int axis = 0; axis < 3; ++axis) {
        mean[axis] = sum[axis] / length;
        centre[axis] = static_cast<float>(mean[axis]);
    }
    int least = 0;
    for (int axis = 1; axis < 3; ++axis) {
        if (std::abs(mean[axis]) < std::abs(mean[least])) least = axis;
    }
    double size = 0;
    for (int axis = 0; axis < 3; ++axis) {
        axes[0][axis] = (axis == least ? 1.0 : 0.0) - mean[axis] * mean[least];
        size += axes[0][axis] * axes[0][axis];
    }
    for (int axis = 0; axis < 3; ++axis) axes[0][axis] /= std::sqrt(size);
    for (int axis = 0; axis < 3; ++axis) {
        const int next = (axis + 1) % 3;
        const int last = (axis + 2) % 3;
        axes[1][axis] = mean[next] * axes[0][last] - mean[last] * axes[0][next];
    }
    return true;
}

/// The largest |x / z| or |y / z| of the samples.
HWY_INLINE double sampled_extent(const Samples& samples, const double axes[3][3]) {
    double extent = 0;
    for (std::size_t i = 0; i < samples.count; ++i) {
        double h[3] = {0, 0, 0};
        for (int k = 0; k < 3; ++k) {
            for (int axis = 0; axis < 3; ++axis) h[k] += axes[k][axis] * samples.dirs[i][axis];
        }
        if (h[2] > 0) extent = std::max(extent, std::max(std::abs(h[0]), std::abs(h[1])) / h[2]);
    }
    return extent;
}

/// The error of a place x / z or y / z with |x / z|, |y / z| <= s, in units of 2^-24 s:
/// kPlaceUnits + kPlaceUnitsOfExtent * s. NearDirections derives it.
inline constexpr float kPlaceUnits = 28;
inline constexpr float kPlaceUnitsOfExtent = 20;

/// Computes axes * d for directions d near the multiples of `centre`, with a small error.
///
/// 1. Let c = centre, k its largest axis, l = d[k] / c[k]. Then axes * d = axes * (d - l c) + l
///    (axes * c), and axes * c comes from double.
/// 2. d - l c is small and, fused, rounds by u = 2^-24 of itself. With the rounding of the row and
///    of three sums, each row of axes * (d - l c) is off by at most 5 u |d - l c|.
/// 3. Let |x / z|, |y / z| <= s. d differs from z axes[2] by at most sqrt(2) z s across, and d - l
///    c by sqrt(3) as much again along c: |d - l c| <= 3.9 z s, so x is off by 19.5 u z s from
///    this.
/// 4. z is off by the same and by 5 u z: axes * c and the sums. A division rounds by 2 u.
/// 5. Together x / z and y / z are off by at most (kPlaceUnits + kPlaceUnitsOfExtent * s) s u
///    (lab/proofs/packet_rays.g).
/// 6. Without fused operations 2^-23 |d| is added; place_error's dot_error covers it.
class NearDirections {
public:
    /// scale: multiplies x and y; a power of two, so that nothing is rounded.
    NearDirections(const double axes[3][3], const float centre[3], double scale) {
        for (int axis = 0; axis < 3; ++axis) {
            centre_[axis] = centre[axis];
            if (std::abs(centre[axis]) > std::abs(centre[largest_])) largest_ = axis;
        }
        for (int k = 0; k < 3; ++k) {
            double sum = 0;
            for (int axis = 0; axis < 3; ++axis) {
                const double row = axes[k][axis] * (k < 2 ? scale : 1);
                rows_[k][axis] = static_cast<float>(row);
                sum += row * centre[axis];
            }
            at_centre_[k] = static_cast<float>(sum);
        }
        reciprocal_ = 1.0f / centre_[largest_];
    }

    /// Sets h = axes * d.
    HWY_INLINE void project(const FloatVec d[3], FloatVec h[3]) const {
        const FloatVec l = d[largest_] * splat(reciprocal_);
        FloatVec across[3];
        for (int axis = 0; axis < 3; ++axis)
            across[axis] = neg_mul_add(l, splat(centre_[axis]), d[axis]);
        for (int k = 0; k < 3; ++k) {
            h[k] = l * splat(at_centre_[k]);
            for (int axis = 0; axis < 3; ++axis)
                h[k] = mul_add(splat(rows_[k][axis]), across[axis], h[k]);
        }
    }

private:
    float rows_[3][3];
    float at_centre_[3];
    float centre_[3];
    float reciprocal_;
    int largest_ = 0;
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();

#endif
