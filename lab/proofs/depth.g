# z of a hit against the mean of the vertices' z under exact weights, its sign, and t.
#
#   bounds       |z - mean| <= (2 (1 - kSpareOfBound) bound / sum + kRangeOfDepths) range
#                + kSizeOfDepths size; the part with bound is at most M / 2 where surely_inside
#                agrees; beyond `error` z has the sign of the mean, that of a.z before its rounding
#                included; |t - z / d.z| <= kTravel |z / d.z|
#   code         weighted_hit, scaled_weight, surely_inside (common/interop/hit_rule.h)
#   constants    kDepthSlackOfMargin is ShearedRay::depth_slack over M
#   inputs       edge functions of one sign that are not all 0 (a triangle may have no area), those
#                of exact_edges (bound = 0) or ones that surely_inside accepts; the vertices' z as
#                projected; range = zmax - zmin, size = the largest |z|
#   operations   sum = fl(fl(|u| + |v|) + |w|); scale = rcp(sum); wb = fl(|v| scale),
#                wc = fl(|w| scale), 0 where below 2^-60; wa = max(fl(1 - fl(wb + wc)), 0)
#                z = fl(fl(fl(wa za) + fl(wb zb)) + fl(wc zc)), clamped to the least and the
#                greatest of za, zb, zc; t = fl(z rcp(d.z))
#                error = fl(fl(fl(2 fl(bound scale) + kWeightRounding) fl(range))
#                + fl(kMeanRounding size))
#   used by      boxes.g, surface_offset.g, fast_hits.g
#   by hand      Three steps lead from the mean to z. (1) The functions as computed against exact
#                ones. The |z_i - mean| under exact weights have a mean of at most range / 2, which
#                bounds the effect of relative errors; they add up to at most 2 range, which bounds
#                that of absolute ones. (2) wb and wc against the functions as computed, with
#                1 - wb - wc for wa. (3) Roundings. A wa that is clamped makes the weights' sum
#                exceed 1: that is an error by size, the largest one. There
#                sum >= fl(|v| + |w|), because fl(|u| + |v|) >= |v|; and 0 + fl(wb zb) is exact.
#                Signs: fl(range) < size only if all z are beyond 0 on one side, because otherwise
#                range >= size and rounding is monotone (also small_floats.cpp). The weights add up
#                to more than 3/4, so one is above 1/4, and all products have one sign: |z| is at
#                least that product, which is not 0 (grids.cpp). Where |z| > error, |z - mean| < |z|.
#                Clamping: the mean under exact weights is between the vertices' z, so that z comes
#                no farther from it, and keeps the sign that they have in common.
#                Order: rcp(d.z) is one float for all triangles of a ray and rounding is monotone,
#                so t never decreases (d.z > 0) or never increases (d.z < 0) with z.
#
# step 0.99: kRangeOfDepths kSizeOfDepths kTravel
# step 0.5: kWeightRounding kMeanRounding
# step 1.1: kDepthSlackOfMargin kDifferenceOfProducts kRcpUlp
# kMeanRounding: 0.92 would do

## identity: errors of functions move the mean by the sum of error_i (z_i - mean) / sum
(ea + da) * za + (eb + db) * zb + (ec + dc) * zc - (ea + da + eb + db + ec + dc) * z
  - (da * (za - z) + db * (zb - z) + dc * (zc - z)) - (ea * za + eb * zb + ec * zc
  - (ea + eb + ec) * z);

## identity: errors of wb and wc move it by parts of the range
(1 - (b + db) - (c + dc)) * za + (b + db) * zb + (c + dc) * zc
  - ((1 - b - c) * za + b * zb + c * zc) - (db * (zb - za) + dc * (zc - za));

# (1) + (2): b + c <= 1; two dropped weights are less than 2^-59 together
## lemma: both together are at most kRangeOfDepths range
functions = @kDifferenceOfProducts@ / (1 - @kDifferenceOfProducts@) / 2;
factor = (1 + w) * (1 + r * rcp_error) / ((1 + s1) * (1 + s2));
{ |r| <= 1 /\ rounded(w, s1, s2) -> |(factor - 1) / (@kRangeOfDepths@ - functions - 0x1p-59)| <= 1 }

## lemma: where wa is not clamped, the weights add up to 1 within 1.5 e (x = wb + wc)
sum = float<24,-149,ne>(x);
wa = float<24,-149,ne>(1 - sum);
{ x in [0, 0x1.000001p0] /\ sum in [0, 1]
  -> |(wa - (1 - sum)) - (sum - x)| <= 0x1.8p-24 }

## identity: wa + wb + wc - 1 is that
(wa - (1 - sum)) - (sum - x) - (wa + x - 1);

## lemma: that and three roundings of each term are at most kSizeOfDepths size
{ @kSizeOfDepths@ - ((up^3 - 1) * (1 + 0x1.8p-24) + 0x1.8p-24) >= 0 }

## lemma: where wa is clamped, so are the excess of wb + wc and two roundings
excess = up * (1 + rcp_error) / down - 1;
{ @kSizeOfDepths@ - ((up^2 - 1) * (1 + excess) + excess) >= 0 }

## lemma: surely_inside: fl(bound range) <= fl(depth_slack sum), so that this is at most M / 2
allowed = up^3 * @kDepthSlackOfMargin@;    # of M times the sum
error = down^2;                                          # of bound times range
{ 2 * (1 - @kSpareOfBound@) * (allowed / error) <= 0.5 }

## lemma: error as computed is beyond the bounds, the rounding of a.z included
scale = (1 - rcp_error) / up^2;    # times the exact sum
{ scale * down^5 - (1 - @kSpareOfBound@) >= 0
  /\ @kWeightRounding@ * down^4 - @kRangeOfDepths@ >= 0
  /\ @kMeanRounding@ * down^2 - (@kSizeOfDepths@ + e) >= 0 }

## lemma: t is within kTravel of z / d.z
{ |r| <= 1 /\ rounded(w) -> |((1 + r * rcp_error) * (1 + w) - 1) / @kTravel@| <= 1 }
