# A ray against the box of a triangle that it hits, t of the hit, and the slab test.
#
#   bounds       at the depth of H the ray is within 2/5 D of the triangle's box; the slab test rounds
#                by at most 3/5 D; so entry <= t_H <= exit for the box dilated by D, where t_H belongs
#                to H. t of the hit is within M / 32 (exact path) or 9/16 M (fast path) of t_H, and
#                org + t * dir within that of the box: so entry <= last_entry of t
#   code         box_dilation, depth_margin, last_entry, hits_box, slab_reciprocal
#                (common/interop/slab.h)
#   constants    kBoxDilation (D = kBoxDilation E), kDepthMargin (M = kDepthMargin E),
#                kHugeReciprocal
#   inputs       E = max(kSceneExtent, |org|) = 1 (real numbers scale), so that vertices, origin and
#                planes are at most 1 and a = vertex - org at most 2 on each axis; t at most 2.01
#   operations   entry = fl(fl(lower - fl(org + D)) * rcp(d)); last_entry = fl(t + M)
#   used by      every tree
#   by hand      H, the point at the exact weights, is in the box. t_H = (H.z - org.z) / d.z. The
#                weights make the mean of the compensated x 0, so at t_H the ray is as far from H on the
#                other axes, times d.z, as the mean error of the projection. z of the hit is off from
#                that of H by the mean, the difference a.z and the travel; an error of z or t moves the
#                point by no more on the other axes. The range of z is at most twice their size. With
#                g = lower - org - D <= t_H d - 3/5 D: entry d <= g + |entry d - g|. The exit and
#                negative d mirror this. t_H > 0 since the sign of z is certain (depth.g), so an
#                entry of 0 is not too late.
#
# step: kBoxDilation 0.5
# step: kDepthMargin 0.5
# step: kProjection 4
# step: kHugeReciprocal 1/4194304 (2^43 would do)

## lemma: 2/5 D covers the error of the projection
r = 2 * (1 + @kRounding@);
projection = @kProjection@ * 2 * r + @kProjectionOfRange@ * r + @kProjectionSnap@ / @kSceneExtent@;
{ 0.4 * @kBoxDilation@ - projection >= 0 }

## lemma: M / 32 covers the errors of projection, mean, t and a.z
r = 2 * (1 + @kRounding@);
projection = @kProjection@ * 2 * r + @kProjectionOfRange@ * r + @kProjectionSnap@ / @kSceneExtent@;
mean = @kRangeOfDepths@ * 2 * r + @kSizeOfDepths@ * r;
travel = @kTravel@ * r * (1 + 0x1p-19);
difference = @kRounding@ * r;
{ @kDepthMargin@ / 32 - (projection + mean + travel + difference) >= 0 }

## lemma: and where fast edge functions weigh, the M / 2 of depth.g comes on top: 9/16 M is enough
{ 1 / 32 + 1 / 2 <= 0.5625 }

## lemma: last_entry rounds t + M by less than the rest of M, for t of hits; a larger t is farther
{ 0.4375 * @kDepthMargin@ - @kRounding@ * (2.01 + @kDepthMargin@) >= 0 }

## lemma: the slab test rounds by at most 3/5 D
p = e1 * (org + @kBoxDilation@);
rho = @kRcpUlp@ * 0x1p-23;
factor = (1 + e2) * (1 + r * rho) * (1 + e3);
{ |org| <= 1 /\ |g| <= 0x2.01p0 /\ |r| <= 1 /\ |e1| <= @kRounding@ /\ |e2| <= @kRounding@
  /\ |e3| <= @kRounding@ -> |(g * (factor - 1) - p * factor) / 0.6 / @kBoxDilation@| <= 1 }

## lemma: this is entry d - g
p = e1 * (org + D);
{ (lower - (org + D + p)) * factor - (lower - org - D) - ((lower - org - D) * (factor - 1)
  - p * factor) in [0, 0] }
(lower - (org + D + p)) * factor - (lower - org - D) - ((lower - org - D) * (factor - 1)
  - p * factor) -> 0;

## lemma: 3/5 D times kHugeReciprocal is beyond every t (2^43)
D = @kBoxDilation@ * @kSceneExtent@;
{ D * 0.6 * @kHugeReciprocal@ * (1 - @kRounding@) >= 0x1p43 }
