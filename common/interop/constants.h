// Constants of the hit rule, each a power of two (or a simple multiple of one) written as one exact
// decimal literal, because GLSL has no hexadecimal floats and folds constant expressions in double.
// tests/common/interop/arithmetic_test.cpp compares them with their hexadecimal values.
#ifndef COMMON_INTEROP_CONSTANTS_H
#define COMMON_INTEROP_CONSTANTS_H

#include "common/interop/platform.h"

SHARED_BEGIN

// Scene space: every finite vertex coordinate of the animation lies in [-2^20, 2^20] on the grid
// 2^-40, so 60 binary digits separate the largest coordinate from the smallest step. No product of
// the hit rule is a denormal (docs/design/arithmetic.md, "No denormals").
SHARED_CONST float kSceneExtent = 1048576.0f;  // 2^20
// A vertex that is not finite is stored as (kInvalidCoordinate, same, same): 2^40.
SHARED_CONST float kInvalidCoordinate = 1099511627776.0f;
// Ray origins lie within 2^40; farther ones are refused before any tracing.
SHARED_CONST float kOriginExtent = 1099511627776.0f;

SHARED_CONST float kCoordinateOnGrid = 7.62939453125e-06f;  // 2^-17
SHARED_CONST float kCoordinateSnap = 2.288818359375e-05f;   // 1.5 * 2^-16

SHARED_CONST float kDirectionOnGrid = 1.1920928955078125e-07f;  // 2^-23
SHARED_CONST float kDirectionSnap = 3.5762786865234375e-07f;    // 1.5 * 2^-22
SHARED_CONST float kProjectedOnGrid = 9.094947017729282e-13f;   // 2^-40
SHARED_CONST float kProjectedSnap = 2.7284841053187847e-12f;    // 1.5 * 2^-39

// The error of project_fast, derived at fast_edges: 17/16 * 2^-21, and 2^-49.
SHARED_CONST float kFastProjectionError = 5.066394805908203125e-07f;
SHARED_CONST float kFastProjectionFloor = 1.7763568394002505e-15f;

// Rounding of the mean of three z: of the weights, by the range of the z, 2^-21; and of the mean,
// by the largest z, 2^-21.
SHARED_CONST float kWeightRounding = 4.76837158203125e-07f;
SHARED_CONST float kMeanRounding = 4.76837158203125e-07f;

// The error of t, three times that of the mean and what t rounds: 2^-20 by the range and by the
// largest z; and of x and y of project, by z, as a part of kFastProjectionError: 2^-20. A hit whose
// error is a larger part of t is rough: 3 * 2^-17 where the range is more than a quarter of z, else
// 3 * 2^-15.
SHARED_CONST float kHitRounding = 9.5367431640625e-07f;
SHARED_CONST float kFarProjectionError = 9.5367431640625e-07f;
SHARED_CONST float kRoughDepth = 2.288818359375e-05f;
SHARED_CONST float kRoughSlope = 9.1552734375e-05f;
// Refined hits keep to their box up to this part of t, 7 * 2^-24.
SHARED_CONST float kIntervalRounding = 4.172325134277344e-07f;
// No hit is farther: 2^41. The inverse of the error of pairs over 16: 2^38.
SHARED_CONST float kFarthestHit = 2199023255552.0f;
SHARED_CONST float kPairRoom = 274877906944.0f;

// An empty box is inverted: lower = +kEmptyPlane, upper = -kEmptyPlane (2^48). The slab test
// rejects it for every ray because it takes its near and far planes by the sign of the direction.
SHARED_CONST float kEmptyPlane = 281474976710656.0f;
// Stands for 1/0 in the slab test (2^64): large enough to part any two grid values, small enough
// that kEmptyPlane times it does not overflow.
SHARED_CONST float kHugeReciprocal = 18446744073709551616.0f;

// A leaf's box is larger than its vertices' bounds on each side by these parts of its largest
// extent and of the plane's coordinate: 2^-22 and 2^-23.
SHARED_CONST float kPadOfExtent = 2.384185791015625e-07f;
SHARED_CONST float kPadOfPlane = 1.1920928955078125e-07f;
// The slab test dilates boxes on each axis by these parts of |org| there and of max(kSceneExtent,
// |org|): 2^-24 and 2^-40. Slabs end this much farther than computed, 1 + 2^-21, and hits lie no
// more than this factor nearer than their boxes, 1 + 2^-20.
SHARED_CONST float kDilationOfOrigin = 5.9604644775390625e-08f;
SHARED_CONST float kDilationOfExtent = 9.094947017729282e-13f;
SHARED_CONST float kSlabRounding = 1.000000476837158203125f;
SHARED_CONST float kDepthRounding = 1.00000095367431640625f;
// By max(kSceneExtent, |org|): the depth margin, by which t of a hit may be less than the entry
// into its triangle's box, 2^-13.
SHARED_CONST float kDepthMargin = 0.0001220703125f;
// Secondary rays start off the surface by this times the size of the rounding error of the hit
// point (docs/design/arithmetic.md, "Secondary rays"): 2^-16.
SHARED_CONST float kSurfaceOffset = 1.52587890625e-05f;

// The most by which the difference of two coordinates of scene space differs from that of the
// coordinates that were brought there: 2^-39, twice over.
SHARED_CONST float kCoordinateError = 3.637978807091713e-12f;  // 2^-38

// The rule of closest points takes weights and components of offsets below this for 0, 2^-60; and
// components of the height of a triangle below a quarter of the coordinate grid, 2^-42.
SHARED_CONST float kTiny = 8.673617379884035e-19f;
SHARED_CONST float kTinyHeight = 2.2737367544323206e-13f;

// 2^100, the tfar of rays without an end.
SHARED_CONST float kInfiniteT = 1.2676506002282294e+30f;

SHARED_CONST uint kNoPrim = 0xFFFFFFFFu;

SHARED_END

#endif  // COMMON_INTEROP_CONSTANTS_H
