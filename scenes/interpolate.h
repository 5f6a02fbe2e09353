// Positions between two keyframes.
#pragma once

namespace mray {

/// Returns `a + (b - a) * f` in float, and a for f = 0; f in [0, 1). If a, b and b - a are finite,
/// the result lies in the interval between a and b:
///
/// 1. Let d = b - a > 0 (otherwise mirror), D = fl(d) and p = D * f; f <= 1 - 2^-24.
/// 2. If D <= d, then p < D, so fl(p) <= D <= d.
/// 3. If D > d, then D was rounded up and its predecessor D' is at most d. p <= D - D * 2^-24, and
///    D * 2^-24 is at least half of the spacing below D, exactly half only if p = D'. So
///    fl(p) <= D' <= d.
/// 4. Hence a + fl(p) <= a + d = b, and rounding is monotone. fl(p) >= 0 gives the other side.
inline float interpolate(float a, float b, float f) { return f == 0.0f ? a : a + (b - a) * f; }

}  // namespace mray
