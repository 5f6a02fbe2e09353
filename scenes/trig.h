// Sine and cosine of turns from + - * alone: the functions of a libm differ between processors.
#pragma once

#include <cmath>

namespace mray {

/// sin(2 pi x) for finite x within 2^-50; exact at multiples of a quarter turn.
inline double sin_turns(double x) {
    // Into [-1/2, 1/2], then by the symmetry about a quarter turn into [-1/4, 1/4]; both exact.
    double y = x - std::floor(x + 0.5);
    if (y > 0.25) y = 0.5 - y;
    if (y < -0.25) y = -0.5 - y;
    if (y == 0.25) return 1;
    if (y == -0.25) return -1;
    // The Taylor series; its first omitted term is (pi/2)^23 / 23! < 2^-59.
    const double a = 6.283185307179586476925 * y;
    const double s = a * a;
    constexpr double kTerms[] = {1.0 / 420, 1.0 / 342, 1.0 / 272, 1.0 / 210, 1.0 / 156,
                                 1.0 / 110, 1.0 / 72,  1.0 / 42,  1.0 / 20,  1.0 / 6};
    double sum = 1;
    for (const double term : kTerms) sum = 1 - s * term * sum;
    return a * sum;
}

/// cos(2 pi x), with the same error; for finite x.
inline double cos_turns(double x) {
    // floor first: x + 1/4 would round for a large x.
    return sin_turns(x - std::floor(x) + 0.25);
}

struct CosSin {
    double cos, sin;
};
inline CosSin circle_point(double turns) { return {cos_turns(turns), sin_turns(turns)}; }

/// 0 up to begin, 1 from end on, 3 s^2 - 2 s^3 between: with slope and curvature bounded there.
inline double smooth_step(double begin, double end, double x) {
    const double s = std::fmin(std::fmax((x - begin) / (end - begin), 0.0), 1.0);
    return s * s * (3 - 2 * s);
}

}  // namespace mray
