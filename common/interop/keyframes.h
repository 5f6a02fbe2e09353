// Poses between two keyframes.
#ifndef COMMON_INTEROP_KEYFRAMES_H
#define COMMON_INTEROP_KEYFRAMES_H

#include "common/interop/arithmetic.h"

SHARED_BEGIN

// Coordinates of keyframes that devices interpolate lie within 2^126, so that no difference of two
// overflows; a vertex that is not finite is (kNoKeyframe, same, same): 2^127.
SHARED_CONST float kKeyframeExtent = 8.507059173023462e+37f;
SHARED_CONST float kNoKeyframe = 1.7014118346046923e+38f;

/// `a + (b - a) * f` in float, a for f = 0; f in [0, 1). The result lies in the interval between a
/// and b if they are finite and b - a is:
///
/// 1. Let d = b - a > 0 (else mirror), D = fl(d), and p = D * f with f <= 1 - 2^-24.
/// 2. fl(p) <= d. If D <= d, because p < D. If D > d, then D was rounded up, and its predecessor D'
///    is at most d; p <= D - D * 2^-24, and D * 2^-24 is at least half of the spacing below D,
///    exactly half only where p = D' itself; so fl(p) <= D' <= d.
/// 3. Hence a + fl(p) <= a + d = b before the last rounding, and after it, because rounding is
///    monotone. fl(p) >= 0 gives the other side.
SHARED float interpolate(float a, float b, float f) {
    PRECISE float d = b - a;
    PRECISE float p = d * f;
    PRECISE float r = a + p;
    return f == 0.0f ? a : r;
}

/// A vertex in scene space between its places in two keyframes, which are in units of scene space,
/// but not centred; `centre` is scene space's, in the same units.
SHARED vec3 between_keyframes(vec3 a, vec3 b, float f, vec3 centre) {
    PRECISE vec3 p =
        vec3(interpolate(a.x, b.x, f), interpolate(a.y, b.y, f), interpolate(a.z, b.z, f));
    PRECISE vec3 centred = vec3(p.x - centre.x, p.y - centre.y, p.z - centre.z);
    bool is_finite = a.x <= kKeyframeExtent && b.x <= kKeyframeExtent;
    return is_finite ? snap_point(centred) : vec3(kInvalidCoordinate);
}

SHARED_END

#endif  // COMMON_INTEROP_KEYFRAMES_H
