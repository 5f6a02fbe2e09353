# t, u and v of rough hits, and how far t of other hits may be off.
#
#   bounds       |t - exact t| <= error of weighted_hit, for exact t see below; t of refine_hit is within
#                half an ulp and 2^-42 (P / |n.s| + Q / |n.dir| + 1) of itself of that of the plane, with P
#                and Q the sums of magnitudes of the products in n.s and n.dir; it keeps to the padded box
#   code         weighted_hit, exact_edges, refine_hit (common/interop/hit_rule.h), pairs.h,
#                padded_interval (common/interop/slab.h)
#   inputs       as for fast_edges.g, depth.g and boxes.g; B = real_bound, S the sum of edge functions
#   operations   error = fl(fl(fl(6 fl(B scale) + kHitRounding) range) + fl(kHitRounding size))
#                product of pairs = p + fl(err + fl(fl(a.hi b.lo) + fl(a.lo b.hi))), p = fl(a.hi b.hi)
#                quotient = q0 + fl(fl(rest + lower) r), q0 = fl(n.hi r), r = rcp(d.hi),
#                rest = fl(fl(n.hi - p) - err), lower = fl(n.lo - fl(q0 d.lo)), p = fl(q0 d.hi)
#                TrianglePlane (cpu/simd/triangle_plane-inl.h): its bounds, for rays through the triangle, where
#                |p| <= longest: p is off by 2 T of t's error T, 6.1 e^2 t, 3.1 e^2 longest and 2^-62; T is at
#                least 2^-42 t, so 6.1 e^2 t at most T / 2; p x e2 by 2 longest times that and by 11.1 e^2 of its
#                products; n.k by 11.1 e^2 of its products; doubles by 2^-50 of all sums of magnitudes
#                A ray surely goes through a triangle where both weights in doubles are beyond their error and
#                their sum is below 1 by three times it: then t_H need not be clamped
#   used by      the hit rule
#   by hand      Exact t is that of the plane for a ray through the triangle, and else one between that and
#                the mean. Fast edge functions are within bound of those in real arithmetic, too (fast_edges.g). So the mean
#                is off by 2 B range / S' with S' the sum of the other's functions, S' >= S - 3 B >= S / 2
#                where S >= 6 B; elsewhere error is at least range. Sums of pairs: 3 e^2 and terms of e^3
#                (Joldes, Muller, Popescu, theorem 3.1). n is off by 11.1 e^2 of the products' magnitudes,
#                n.s by that, a product and two sums: 25.2 e^2; n.dir by 20.2 e^2; the quotient by 40 e^2.
#                The box: t_H (boxes.g) and the exact t of a ray through the triangle lie in the exact
#                interval of the padded, dilated box; t rounds them once.
#
# step 0.6: kHitRounding
# step 2: kPairRoom
# step 0.7: kIntervalRounding
# step 0.1: kFarProjectionError
# step 0.9999995: kDepthRounding

## lemma: real_bound: project is off by kProjection |x| + kProjectionOfRange (m + Z) + kProjectionSnap
# r = c (2 m + far) + f; the functions by r (m + 2 r), where 2 roundings and products of m^2 / 4 are left
c = @kFastProjectionError@;
low = 1 - 4 * e;
{ low * 2 * c - (@kProjection@ + @kProjectionOfRange@ + @kDifferenceOfProducts@) >= 0
  /\ low * low * c * @kFarProjectionError@ - @kProjectionOfRange@ >= 0
  /\ low * @kFastProjectionFloor@ - @kProjectionSnap@ >= 0 }

## lemma: error has 4 B / S, by the scale's rounding, and all that rounds
scale = (1 - rcp_error) / up^2;
{ 6 * scale * down^5 - 5.99 >= 0
  /\ @kHitRounding@ * down^4 - @kRangeOfDepths@ >= 0
  /\ @kHitRounding@ * down^2 - (@kSizeOfDepths@ + e + @kTravel@ * (1 + 0x1p-18)) >= 0 }

## lemma: a product of pairs: two roundings of terms, of their sum, of the last sum, and a.lo b.lo: 8.01 e^2
{ 8.01 * e * e - (2 * e * e + 2 * e * e * up + (e + 2 * e * up^2) * e + e * e) >= 0 }

## lemma: a pair times a float: 3.01 e^2
{ 3.01 * e * e - (e * e + (e + e * up) * e) >= 0 }

## lemma: the quotient: roundings of rest, lower, their sum and the correction, and of r: 40 e^2
# q0 is off by 3.4 e; so rest by its one rounding after two exact ones, lower by two of e
first = rcp_error + 1.01 * e;
lower = 2.01 * e;
{ 40 * e * e - (first * e + (lower + e) * e * 1.01 + (first + lower) * (1.01 * e + e + rcp_error) * 1.01
                + first * lower * 1.01) >= 0 }

## lemma: kPairRoom: 16 times the error of pairs is within that of the hit
{ 0x1p42 / 16 * (1 + 0x1p-20) - @kPairRoom@ >= 0 /\ 0x1p-42 - 40 * e * e >= 0 }

## lemma: in all 2^-42
{ 0x1p-42 - 25.2 * e * e * (1 + 0x1p-18) >= 0 /\ 0x1p-42 - 40 * e * e * (1 + 0x1p-18) >= 0 }

## lemma: what rounds to a t in the box keeps to it: entries are at most 3.01 e late
{ down - (1 + 0x3.01p-24) * (1 - @kIntervalRounding@ * down) * up >= 0 }

## lemma: it may be that much before the entry
{ (1 - @kIntervalRounding@ * up) * down * @kDepthRounding@ * down - 1 >= 0 }

## lemma: TrianglePlane: 1.0625 2^-42 holds the pairs' 2^-42 and doubles; so do the parts of weights
{ 0x1.1p-42 - (0x1p-42 + 0x1p-48) >= 0
  /\ 0.5 * 0x1p-42 - 6.1 * e * e >= 0
  /\ 4 * 0x1p-44 - (3.1 * e * e + 11.1 * e * e) >= 0
  /\ 0x1p-60 - 0x1p-62 >= 0
  /\ 0x1.1p-42 - (40 * e * e + 11.1 * e * e) >= 0 }
