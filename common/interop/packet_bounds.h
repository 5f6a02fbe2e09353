// The constants of the bounds that let a packet of the CPU decide about a triangle without the hit
// rule: docs/design/arithmetic.md, "Packets", derives each by the name that it has here, and
// lab/proofs/ checks it. u stands for 2^-24.
#ifndef COMMON_INTEROP_PACKET_BOUNDS_H
#define COMMON_INTEROP_PACKET_BOUNDS_H

#include "common/interop/platform.h"

SHARED_BEGIN

// ---- How far x - X z and y - Y z of a vertex, as a ray (X, Y) sees them, are together from those
// of the vertex that the rule displaces (for a ray through the triangle).

// By the extent of the triangle from its leaf's first vertex, times row_sizes: 24 u.
SHARED_CONST float kExtentError = 1.430511474609375e-06f;
// By the distance of that vertex from the origin, times row_sizes: 2^-42.
SHARED_CONST float kDistanceError = 2.2737367544323206e-13f;
// Times row_sizes: 2^-61.
SHARED_CONST float kGridError = 4.336808689942018e-19f;
// In units of the plane, so that no product of errors underflows: 2^-50.
SHARED_CONST float kPlaneFloor = 8.881784197001252e-16f;
// By |x - X z| + |y - Y z| themselves: 4 u.
SHARED_CONST float kLateralError = 2.384185791015625e-07f;
// By z, times the largest |X| or |Y| of the packet: 12 u.
SHARED_CONST float kShearError = 7.152557373046875e-07f;
// How far z is off by itself, besides the first four: 4 u.
SHARED_CONST float kDepthError = 2.384185791015625e-07f;

// ---- Rays.

// Times how far a ray may be from where it is taken for, and the slope of what is evaluated there.
SHARED_CONST float kRayError = 1.01f;
// The error of 1 / z at a ray's end, by itself: 2^-22.
SHARED_CONST float kEndError = 2.384185791015625e-07f;
// The error of a stored ray's place, by the magnitudes of its sums in double: 2^-50.
SHARED_CONST float kStoredPlaceRounding = 8.8817841970012523233890533447265625e-16f;
// The error of 1 / (t z) by product and quotient, 2^-22, and of z by the magnitudes of its sum:
// 2^-21.
SHARED_CONST float kHitDepthRounding = 2.384185791015625e-07f;
SHARED_CONST float kHitDotRounding = 4.76837158203125e-07f;

// ---- Rectangles.

// Times the errors of vertices and of rays.
SHARED_CONST float kRectangleError = 1.0625f;
// By the quotients themselves: 8 u. By sums with places in the packet: 2^-16.
SHARED_CONST float kQuotientError = 4.76837158203125e-07f;
SHARED_CONST float kRectangleRounding = 1.52587890625e-05f;

// The error of a box's planes in a row, by the row's size times the largest coordinate: 16 u.
SHARED_CONST float kBoxError = 9.5367431640625e-07f;
// How far a box is outside a wedge that holds all rays, by its largest coordinate: 2^-12.
SHARED_CONST float kWedgeMargin = 0.000244140625f;
// Only frames whose axes span more than this part, 2^-28, of the product of their sizes have
// wedges, and only if no ray's largest component at z = 1 is more than kMostWedgeDepths times
// another's.
SHARED_CONST float kLeastWedgeSpan = 3.725290298461914e-9f;
SHARED_CONST float kMostWedgeDepths = 64.0f;

// ---- Edge functions of vertices up to `size` from the ray in the middle, and up to `reach` from
// any: their rounding is kEdgeRounding size (reach + kShearRounding z), 14 u.
SHARED_CONST float kEdgeRounding = 8.344650268554688e-07f;
// Times the largest |X| or |Y|.
SHARED_CONST float kShearRounding = 1.5f;

// ---- The volume of triangle and origin.

// Times the error of a vertex, the reach of a hit and z.
SHARED_CONST float kVolumeError = 6.5f;
// By the reach of a hit squared times z: 128 u; and times the part of z in the extent: 64 u.
SHARED_CONST float kVolumeRounding = 7.62939453125e-06f;
SHARED_CONST float kVolumeExtentError = 3.814697265625e-06f;
// 1 / z is known between these two, where its reciprocal neither overflows nor underflows.
SHARED_CONST float kLeastVolume = 1e-30f;
SHARED_CONST float kMostVolume = 1e34f;
// Times the volume's error by the nearest z, a bound of the sum of a hit's edge functions where the
// volume's sign is uncertain.
SHARED_CONST float kEitherSign = 2.125f;

// ---- 1 / z of the plane.

// The roundings of the plane add this to the error of a vertex: 6 u of size.
SHARED_CONST float kPlaneError = 3.5762786865234375e-07f;
// Times a vertex's error and the gradient of 1 / z, relative to 1 / z.
SHARED_CONST float kSteepError = 2.25f;
// Roundings by the gradient, in a packet of 64 rays across: 2^-14; and by 1 / z itself: 32 u.
SHARED_CONST float kGradientRounding = 6.103515625e-05f;
SHARED_CONST float kReciprocalRounding = 1.9073486328125e-06f;
// By the largest z on the rule's axis: kMeanRounding, the rounding of t, and what the packet rounds
// z itself: 16 u.
SHARED_CONST float kRuleDepthError = 9.5367431640625e-07f;
// Times how much nearer the rule may place a hit, for all that is left out of that.
SHARED_CONST float kRuleDepthFactor = 1.5f;
// Beyond this part of z, times kRuleDepthFactor, nothing is known of 1 / z: how much nearer the
// rule may place a hit has a second order.
SHARED_CONST float kFarDepth = 0.1875f;
// Where the plane in scene space bounds 1 / z (lab/proofs/packet_slant.g): the error of a
// vertex by its rows in the projection, times the extent: 10 u; by the plane's normal, times the
// extent and the distance: 12 u and 4.5 u; and in z, by the depth margin: 21 * 2^-12.
SHARED_CONST float kVertexError = 5.9604644775390625e-07f;
SHARED_CONST float kSlantExtent = 7.152557373046875e-07f;
SHARED_CONST float kSlantDistance = 2.682209014892578125e-07f;
SHARED_CONST float kFastDepthOfMargin = 0.005126953125f;
// Times how far a ray may be from where it is taken for, and the gradient of 1 / z.
SHARED_CONST float kRayDepthError = 1.375f;
// The least volume, times 1 + size + z: no denormal counts.
SHARED_CONST float kLeastSlantVolume = 1e-27f;
// The error of a normal without fused operations, by size, and all that follows from it: 64 u.
SHARED_CONST float kUnfusedDepth = 3.814697265625e-06f;
// Planes with more than this error, relative to 1 / z, are not known: 2^-5.
SHARED_CONST float kMostSlope = 0.03125f;
// 1 / z at its nearest, times z.
SHARED_CONST float kNearestByDepth = 1.00001f;

// ---- Certain misses, by constants that are found once a leaf.

// Times the bound of edge functions: for a ray, and on top of that for a block.
SHARED_CONST float kMissBound = 1.25f;
SHARED_CONST float kBlockBound = 0.5f;
// By the gradient of 1 / z: 2^-18, and for a block 2^-14 on top of that.
SHARED_CONST float kMissGradient = 3.814697265625e-06f;
SHARED_CONST float kBlockGradient = 6.103515625e-05f;

// ---- Rays without a packet.

// The error of the mean of depths under fast edge functions, by the sum of their magnitudes: 2^-22.
SHARED_CONST float kBehindError = 2.384185791015625e-07f;
// The bound of edge functions for vertices at any depth, over edge_bound(): 1 + 2^-17.
SHARED_CONST float kDepthlessBound = 1.00000762939453125f;
// How far within its range the depth of a certain occluder is: times the bound of edge functions
// and the largest |z|; and by the size of the scene and of the origin, 2^-16. For origins within
// 2^30.
SHARED_CONST float kCertainBound = 32.0f;
SHARED_CONST float kCertainDepth = 1.52587890625e-05f;
SHARED_CONST float kCertainOrigin = 1073741824.0f;
// A triangle certainly lies beyond tfar if its depth is beyond by two margins added up:
// kBeyondBound times the bound of edge functions times the range of its z, and kBeyondDepth (2^-17)
// times the size of the scene and of the origin. This holds where the sum of the edge functions is
// at least kCertainBound times their bound.
SHARED_CONST float kBeyondBound = 5.5f;
SHARED_CONST float kBeyondDepth = 7.62939453125e-06f;
// In place of kBeyondBound where edge functions are the rule's own and surely have one sign.
SHARED_CONST float kOwnBeyondBound = 2.5f;

SHARED_END

#endif  // COMMON_INTEROP_PACKET_BOUNDS_H
