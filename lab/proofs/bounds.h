// Bounds that one proof shows and others build on: its name stands as @name@ in the .g files.
#ifndef PROOFS_BOUNDS_H
#define PROOFS_BOUNDS_H

namespace mray::proofs {

/// Half an ulp: a float operation is off by at most this times its result.
inline constexpr double kRounding = 0x1p-24;

/// Relative error of difference_of_products (difference_of_products.g): 2^-23 to first order.
inline constexpr double kDifferenceOfProducts = 0x1.00002p-23;

/// |x - exact| <= kProjection |x| + kProjectionOfRange r + kProjectionSnap (project.g), where r is
/// the largest |component| of vertex - org. docs/design/arithmetic.md rounds to 2^-22 and 2^-44.
inline constexpr double kProjection = 0x1.8001p-23;
inline constexpr double kProjectionOfRange = 0x1.0001p-44;
inline constexpr double kProjectionSnap = 0x1p-62;

/// Relative errors of rcp and rsqrt in ulp of the exact value (reciprocals.cpp).
inline constexpr double kRcpUlp = 1.155;
inline constexpr double kRsqrtUlp = 1.218;

/// Relative error of slab_reciprocal (boxes.g).
inline constexpr double kSlabReciprocal = 0x1.001p-24;

/// z of a hit from its mean under exact weights, where the exact edge functions give the
/// weights: this part of the range of the vertices' z, and that part of the largest (depth.g).
inline constexpr double kRangeOfDepths = 6.32 * 0x1p-24;
inline constexpr double kSizeOfDepths = 6.32 * 0x1p-24;

/// Relative error of t against z / d.z (depth.g).
inline constexpr double kTravel = 3.32 * 0x1p-24;

/// The part of Edges::bound left without the fast edge functions' error (fast_edges.g).
inline constexpr double kSpareOfBound = 0x1p-5;

/// A coordinate of a packet's vertex (packet_vertices.g): off by kVertexOfPlace of itself and by
/// kVertexOfEdges of the sum of its row times the extent. With the rule's displacement, for a ray
/// through the triangle, the latter is kVertexOfExtent, and kVertexOfRange of the first vertex's
/// distance comes on top.
inline constexpr double kVertexOfPlace = 2.0001 * 0x1p-24;
inline constexpr double kVertexOfEdges = 6.501 * 0x1p-24;
inline constexpr double kVertexOfExtent = 18.503 * 0x1p-24;
inline constexpr double kVertexOfRange = 43.1 * 0x1p-48;

/// Errors of the factors that products have in an edge function of a packet (packet_edges.g): by
/// the way from the middle, by the place of the middle, and where there is neither.
inline constexpr double kEdgeLateral = 6.0001 * 0x1p-24;
inline constexpr double kEdgeMiddle = 4.0001 * 0x1p-24;
inline constexpr double kEdgeConstant = 7.0001 * 0x1p-24;

}  // namespace mray::proofs

#endif  // PROOFS_BOUNDS_H
