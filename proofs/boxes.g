# A hit against the box of its triangle, and the slab test against a hit.
#
#   bounds       a hit is within D / 32 (exact path) or 9/16 D (fast path) of the box of its
#                triangle; the slab test rounds by at most D / 64, which leaves 7/16 D beyond doubt:
#                so entry <= t <= exit for the box dilated by D
#   code         box_dilation, hits_box, slab_reciprocal (common/interop/slab.h)
#   constants    kBoxDilation (D = kBoxDilation E), kHugeReciprocal
#   inputs       E = max(kSceneExtent, |org|) = 1 (real numbers scale), so that vertices, origin and
#                planes are at most 1 and a = vertex - org at most 2 on each axis
#   operations   entry = fl(fl(lower - fl(org + D)) * rcp(d))
#   used by      every tree
#   by hand      H, the point at the exact weights, is in the box. The weights make the mean of the
#                compensated x 0, so H is as far from the ray, times d.z, as the mean error of the
#                projection; an error of z or t moves the point by no more on the other axes. The range
#                of z is at most twice their size. With
#                g = lower - org - D <= t d - 7/16 D: entry d <= g + |entry d - g|. The exit and
#                negative d mirror this.
#
# step: kBoxDilation 0.5
# step: kProjection 4
# step: kHugeReciprocal 1/134217728 (2^38 would do)

## lemma: D / 32 covers the errors of projection, mean, t and a.z
r = 2 * (1 + @kRounding@);
projection = @kProjection@ * 2 * r + @kProjectionOfRange@ * r + @kProjectionSnap@ / @kSceneExtent@;
mean = @kRangeOfDepths@ * 2 * r + @kSizeOfDepths@ * r;
travel = @kTravel@ * r * (1 + 0x1p-19);
difference = @kRounding@ * r;
{ @kBoxDilation@ / 32 - (projection + mean + travel + difference) >= 0 }

## lemma: and where fast edge functions weigh, the D / 2 of depth.g comes on top: 9/16 D is enough
{ 1 / 32 + 1 / 2 <= 0.5625 }

## lemma: the slab test rounds by at most D / 64
p = e1 * (org + @kBoxDilation@);
rho = @kRcpUlp@ * 0x1p-23;
factor = (1 + e2) * (1 + r * rho) * (1 + e3);
{ |org| <= 1 /\ |g| <= 0x2.01p0 /\ |r| <= 1 /\ |e1| <= @kRounding@ /\ |e2| <= @kRounding@
  /\ |e3| <= @kRounding@ -> |(g * (factor - 1) - p * factor) * 64 / @kBoxDilation@| <= 1 }

## lemma: this is entry d - g
p = e1 * (org + D);
{ (lower - (org + D + p)) * factor - (lower - org - D) - ((lower - org - D) * (factor - 1)
  - p * factor) in [0, 0] }
(lower - (org + D + p)) * factor - (lower - org - D) - ((lower - org - D) * (factor - 1)
  - p * factor) -> 0;

## lemma: 7/16 D is more than that, and times kHugeReciprocal it is beyond every t (2^43)
D = @kBoxDilation@ * @kSceneExtent@;
{ 0.4375 - 0x1p-6 >= 0 /\ D * (0.4375 - 0x1p-6) * @kHugeReciprocal@ * (1 - @kRounding@) >= 0x1p43 }
