# A ray against the padded box of a triangle that it hits, t of the hit, and the slab test.
#
#   bounds       a plane is stored at least 3.01 e extent outside of the triangle; at the depth of H the
#                ray is no more than that and 2^-42 E outside of the triangle. So entry <= (1 + 3.01 e)
#                t_H and fl(exit kSlabRounding) is no less, where t_H belongs to H. t of the hit is within
#                M / 32 (exact path) or 9/16 M (fast path) of t_H, and org + t * dir within that of the
#                box: so entry <= last_entry of t, and entry - M <= last_depth of t. On the main axis,
#                entry <= last_depth of t without M
#   code         plane_pad, padded (common/bvh/box.h), slab_ray, depth_margin, last_entry, last_depth,
#                least_depth, hits_box, slab_reciprocal (common/interop/slab.h)
#   constants    M = kDepthMargin E
#   inputs       E = max(kSceneExtent, |org|) = 1 (real numbers scale), so that vertices, origin and
#                planes are at most 1 and a = vertex - org at most 2 on each axis; t at most 2.01E.
#                extent: the largest one of the triangle, at most that of its leaf
#   operations   plane = fl(v -+ fl(fl(kPadOfExtent fl(extent)) + fl(kPadOfPlane |v|)))
#                D = fl(fl(kDilationOfOrigin |o|) + fl(kDilationOfExtent E))
#                entry = fl(fl(plane - fl(o + D)) * r); last_entry = fl(t + M)
#   used by      every tree; near.g
#   by hand      H, the point at the exact weights, is in the box. t_H = (H.z - org.z) / d.z. The
#                weights make the mean of the compensated x 0, so at t_H the ray is as far from H on the
#                other axes, times d.z, as the mean error of the projection. That is at most kProjection
#                times the mean of |x|, and terms of the origin; a mean of |x| around 0 is at most half the
#                range of x, compensated, which is at most d.z (extent + extent) and twice the largest
#                error more. z of the hit is off from that of H by the mean, the difference a.z and
#                the travel; an error of z or t moves the point by no more on the other axes. The range
#                of z is at most twice their size. Let o and d > 0 be those of the axis, q = plane - o <= t_H d +
#                (the 2^-42 E). Where entry > 0, entry d = (q - D - e1 (o + D)) (1 + e2) (1 + r) (1 + e3) <= t_H d
#                times the factors, since D is more than the rest. The exit mirrors this, with t_H > 0,
#                and so does negative d. t_H > 0 since the sign of z is certain (depth.g), so an entry
#                of 0 is not too late. On the main axis all z of a triangle in a box with entry > 0 have
#                one sign, so that z of the hit is at least the least |z| less roundings of weights (which
#                add up to 1 - 1.5 e), terms and sums.
#
# step 0.5: kPadOfExtent kPadOfPlane kDilationOfOrigin kDilationOfExtent kDepthMargin
# step 0.9999997: kSlabRounding
# step 0.9999995: kDepthRounding
# step 4: kProjection
# step 1/4194304: kHugeReciprocal
# kHugeReciprocal: 2^43 would do

## lemma: displacement: 3.001 e extent, and 2^-42 E
# mean |error| <= kProjection X / 2 + a, where the compensated range X <= (2 d.z extent + 2 a) / (1 - 2 kProjection)
r = 2 * up;
a = @kProjectionOfRange@ * r + @kProjectionSnap@ / @kSceneExtent@;
part = @kProjection@ / (1 - 2 * @kProjection@);
{ 3.001 * e - part >= 0 /\ 0x1p-42 - a * (1 + part) >= 0 }

## lemma: a plane is stored at least 3.01 e extent outside: fl(v - pad) < v - pad + e (|v| + pad)
# extent, sum, difference
{ @kPadOfExtent@ * down^3 - 3.01 * e >= 0 /\ @kPadOfPlane@ * down^3 - e >= 0 }

## lemma: D is more than the rounding of o + D, e (|o| + D), and 2^-42 E, by 2^-41 E; |o| <= 1
# the sum of D; e D
{ @kDilationOfOrigin@ * down^2 - e + 0x1p-44 >= 0
  /\ @kDilationOfExtent@ * down^2 - 0x1p-42 - 0x1p-41 - 0x1p-44 >= 0 }

## lemma: slab_reciprocal: y = (1 + p) / x, residual -p, its step and two roundings
p = r * rcp_error;
{ |r| <= 1 /\ rounded(e1, e2, e3)
  -> |((1 - p * p - p * (1 + p) * (e1 + e2 + e1 * e2)) * (1 + e3) - 1) / @kSlabReciprocal@| <= 1 }

## identity: this is its product with x
(1 + p) * (1 - p * (1 + e1) * (1 + e2)) - (1 - p * p - p * (1 + p) * (e1 + e2 + e1 * e2));

## lemma: difference, reciprocal and product: 3.01 e
f = (1 + e2) * (1 + r) * (1 + e3);
{ |r| <= @kSlabReciprocal@ /\ rounded(e2, e3) -> |(f - 1) / 0x3.01p-24| <= 1 }

## lemma: the exit times kSlabRounding is not before the entry
{ (1 - 0x3.01p-24) * @kSlabRounding@ * down - (1 + 0x3.01p-24) >= 0 }

## lemma: 2^-41 E times kHugeReciprocal is beyond every t of rays from there (2.01 E)
{ 0x1p-41 * @kHugeReciprocal@ * (1 - 0x4p-24) - 2.02 >= 0 }

## lemma: M / 32 covers the errors of projection, mean, t and a.z
r = 2 * up;
projection = @kProjection@ * 2 * r + @kProjectionOfRange@ * r + @kProjectionSnap@ / @kSceneExtent@;
mean = @kRangeOfDepths@ * 2 * r + @kSizeOfDepths@ * r;
travel = @kTravel@ * r * (1 + 0x1p-19);
difference = e * r;
{ @kDepthMargin@ / 32 - (projection + mean + travel + difference) >= 0 }

## lemma: and where fast edge functions weigh, the M / 2 of depth.g comes on top: 9/16 M is enough
{ 1 / 32 + 1 / 2 <= 0.5625 }

## lemma: last_entry rounds t + M, and entry is late, by less than the rest of M, for t of hits
{ 0.4375 * @kDepthMargin@ - (e * (2.01 + @kDepthMargin@) + 0x3.01p-24 * 2.01) >= 0 }

## lemma: entry - M rounds by no more, and last_depth is not before t
{ 0.4375 * @kDepthMargin@ - (e * 2.02 + 0x3.01p-24 * 2.01) >= 0
  /\ @kDepthRounding@ * down - 1 >= 0 }

## lemma: on the main axis: a.z, the weights, a term and two sums, and t, against the entry
z = down * (1 - 1.5 * e) * down^3;
t = z * (1 - @kTravel@);
{ t * @kDepthRounding@ * down - (1 + 0x3.01p-24) >= 0 }
