# Finishers of packets that ask conservative questions instead of surely_inside and weighted_hit.
#
#   bounds       where they agree, bound as fast_edges computes it is no larger than theirs, and
#                fl(zmax - zmin) < size or z is beyond the error of weighted_hit, so that the rule
#                takes its fast path with the same weights
#   code         FastHits (cpu/simd/hit_rule-inl.h, margin 2^-18 on r and on error)
#   inputs       points of project_fast; exact edge functions whose signs are known to be equal
#   operations   rule: r = fl(fl(c fl((m + m) + Z)) + f), bound = fl(r fl(m + fl(r + r))),
#                c, f = kFastProjectionError, kFastProjectionFloor. FastHits: the same m; each sum
#                and product rounded or fused. The rule's error = fl(fl(fl(2 fl(bound scale) + kWeightRounding) fl(range))
#                + fl(kMeanRounding size)), scale = rcp(sum); theirs = fl(k size + 2 slack), k =
#                2 kWeightRounding + kMeanRounding and a margin on both terms
#   by hand      All terms are positive, and results grow with operands. With a larger bound,
#                "beyond bound" implies that of the rule; the functions then have the exact ones'
#                signs, which are equal. fl(bound max(range, 1)) grows with bound. sum, slack and
#                range are the rule's own floats. nearest > 2^-20 farthest is false unless both are
#                positive, because nearest <= farthest; the product is exact; then size = farthest.
#                max(farthest, -nearest) is the largest |z|. fl(range) <= 2 size, which is a float.
#                Where the rule's fl(bound range) <= fl(slack sum), bound range <= flat slack sum.
#                slack is at least kDepthMargin times 2^18, so an underflow of k size is in the margin.
#                No weight is dropped: a function beyond bound is more than 2^-20 m^2, and the sum
#                of all is less than m^2. The functions weigh in the operations of weighted_hit.

## lemma: FastHits: roundings up of bound, roundings down of their bound, 2^-18 on r
rule = up^8;
ours = (1 + 0x1p-18) * down^8;
{ ours - rule >= 0 }

## lemma: the margin's constants are floats
c = @kFastProjectionError@ * (1 + 0x1p-18);
f = @kFastProjectionFloor@ * (1 + 0x1p-18);
{ float<24,-149,ne>(c) - c in [0, 0] /\ float<24,-149,ne>(f) - f in [0, 0] }

## lemma: nearest > 2^-20 farthest > 0: the range as rounded is less than the size
{ (1 - 0x1p-20) * up <= 0x0.ffffffp0 }

## lemma: FastHits::is_hit_ahead: its error is at least that of weighted_hit
flat = up / down;
slack = flat * (1 + rcp_error) * up^4;    # of 2 slack
size = 2 * @kWeightRounding@ * up^3 + @kMeanRounding@ * up^2;
margin = (1 + 0x1p-18) * down^3;
{ margin - slack >= 0 /\ (2 * @kWeightRounding@ + @kMeanRounding@) * margin - size >= 0 }

## lemma: FastHits::is_surely_smooth: error_by_edges and 1.5 kHitRounding z are less than is allowed
# range < z / 4, so that size < 1.25 z and is_rough asks kRoughSlope; z < 2 t, as dz < 2
error = (0x1.7p-14 * up + 1.5 * @kHitRounding@ * 2 * (1 + 2 * rcp_error) * up^5) * up;
{ @kRoughSlope@ * (1 - 0x1p-10) * down^2 - error >= 0 }

## lemma: FastHits::is_surely_rough: the error by real_bound >= 2 c m^2, with the rule's m and sum
# m is off by 6 r, where r = c (2 m + Z) + f with Z < 2^10 m and 2^-30 < m; the rule's sum is below twice
# ours, as each function is beyond its bound; so scale is more than half of ours
c = @kFastProjectionError@;
off = 6 * (c * (2 + 0x1p10) + @kFastProjectionFloor@ * 0x1p30) * (1 + 0x1p-20);
extent = 1 - off;
error = 6 * 2 * c * (extent * extent) * (1 - rcp_error) / 2 * down^8;
{ error - 0x1.7p-19 * (1 + 0x1p-20) >= 0 }

## lemma: FastHits::is_surely_rough: the means differ by error_by_edges and 2^-18 of the size at most
# both are within 2 B range / S of that of the exact functions, where error_by_edges is 6 B range / S, but for
# kWeightRounding of the range, which is at most 2 size, and kMeanRounding of the size each
{ 0x1p-18 - 2.2 * (2 * @kWeightRounding@ + @kMeanRounding@) >= 0 }
