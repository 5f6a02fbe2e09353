# 1/z of a triangle in a packet of the CPU against that of the rule's hit.
#
#   bounds       |1/z of the rule - q| <= c0 + q (c1 + q c2), q = a X + b Y + c as computed, where
#                (q + that) c2 <= kFarDepth
#   code         DepthBounds, store_depth (cpu/packet/triangle_setup-inl.h), occlude
#                (cpu/packet/light_trace-inl.h), nearest_q (cpu/packet/packet_plane-inl.h)
#   constants    kSlantDistance by |N|_1, kVertexError by the rows, kPlaneError by gradient
#   inputs       |det| > kLeastSlantVolume (1 + size + z_size), < kMostVolume. The rule hits the triangle at the ray (X, Y), |X|, |Y| <= R, with edge functions U; those that are
#                computed are U + rho. On the fast path B max(range, 1) <= M/4 of their sum in floats;
#                all are beyond B there, and rho is less, so the U have one sign.
#   by hand      1. P, the mean of the exact vertices under the weights U / sum(U), is in the triangle's
#                plane. Its point on the ray at the same depth on the rule's axis is Q, and Q - P = e
#                is across: the U are edge functions of points p, so that sum(U p) = 0, and p d.z is
#                off the vertex's true place across the ray by what the path's projection is off.
#                2. With N.p = 1 the plane of the projected vertices in scene space (N = rows^T n / det)
#                and D of them the error of P in the rows, z(Q) q = N.Q = 1 - n.D / det + N.e = 1 - s.
#                |n.D| / det <= |a| D_x + |b| D_y + |c| D_z, |N.e| <= |N|_1 |e|_oo.
#                3. D: 2 u of x, y, z; kVertexOfEdges and kVertexOfRange by the row. |x| <= |l_x| + R |z|;
#                in z, 2 u |c| |z| is 2 u of q |z|, which `shift` has, and R |a| |z|. (Means of |z| may be
#                more than |z| of the mean where vertices lie behind.)
#                4. e: the l have the mean e, so the mean of |l| is half their range, <= 2 extent on an
#                axis of scene space, where edges are <= 2 extent and slopes <= 1, and |e| more.
#                |a.z| <= distance + extent.
#                5. The rule's z is off the mean of depths under the U by the sum of rho (z_i - mean) /
#                sum(U + rho), and by kRangeOfDepths, kSizeOfDepths, kTravel and u of a.z; of the
#                relative part of rho kRangeOfDepths has twice as much. 1 / D_r <= per_depth, |z| <= s_z (distance +
#                extent).
#                6. z(Q) > 0: the rule's z is positive and beyond the errors of step 5 (kWeightRounding,
#                kMeanRounding), or all a.z are.
#                A certain hit (q less its error is above 0, so that g = q c2 < 1) is one of the exact path
#                at least: |z| is beyond the rule's error under exact functions. For that q of the exact
#                plane times c2 must be below 1, too: c0 counts what q is off kRayDepthError times, so it
#                is at most g + g (1 - g) / kRayDepthError.
#                7. a, b, c and det as computed: rounded differences 2 u L, det five factors, of terms up to
#                |det| + 2 size max(|n_x|, |n_y|): rho_det <= 5 u (in kReciprocalRounding) and 10 u size gradient.
#                Without fused operations DepthBounds adds kUnfusedDepth to all magnitudes. So slope <=
#                kMostSlope bounds rho_det, and |det| may be as small as its error in packet_volume.g.
#                Where q < 0 is computed and the exact one is above 0, q = -al d with d what q is off,
#                c1 and c2 take from the bound, and the exact q is at most (1 - al) d.
#                8. c is off by at most kGradientRounding gradient: kShareOfDepth 2^-7 s_z in
#                `rows`, times kRestOfNormal 2^-6, is that in |N|_1; N's own roundings are 6 u of `rows`.
#                9. kMissGradient, most_q (packet_any.g): 1/z(Q) and the rule's are at most `nearest`,
#                by the nearest vertex less its errors, e and shift in z, or by this bound.
#   used by      packet_any.g
#
# step 0.83: kSlantExtent
# step 0.88: kSlantDistance
# step 0.81: kVertexError
# step 0.5: kLateralError kShearError kPlaneError kGradientRounding kUnfusedDepth
# step 0.5: kReciprocalRounding
# step 0.95: kFastDepthOfMargin kFastProjectionError
# step 0.97: kRayDepthError
# step 0.7: kSteepError kRuleDepthFactor kWeightRounding
# step 0.6: kRuleDepthError
# step 1.5: kMeanRounding
# step 1.1: kMostSlope
# step 2: kFarDepth
# step 0.01: kLeastSlantVolume

## identity: project_relative_fast: x = ((v + a) (1 + p) dz (1 + q) - dx z (1 + r) (1 + s)) (1 + t), X = v dz - dx z
(ax * (1 + p) * dz * (1 + q) - dx * az * (1 + r) * (1 + s)) * (1 + t) - (ax * dz - dx * az)
  - ((ax * dz - dx * az) * ((1 + p) * (1 + q) * (1 + t) - 1)
  + dx * az * (((1 + p) * (1 + q) - (1 + r) * (1 + s)) * (1 + t)));

## lemma: 3 u of X, 4 u of |dx az| <= |dz az|
{ rounded(p, q, r, s, t) -> |(1 + p) * (1 + q) * (1 + t) - 1| <= 0x3.001p-24
  /\ |((1 + p) * (1 + q) - (1 + r) * (1 + s)) * (1 + t)| <= 0x4.001p-24 }

## lemma: the exact path: kProjection is 3 u, too
{ 0x3.001p-24 - @kProjection@ >= 0 }

## lemma: kSlantDistance: 4 u (distance + extent) and kProjectionOfRange of it; kSlantExtent: that and 3 u of 2 extent
left = 1 - 32 * e;
of_depth = 0x4.001p-24 + @kProjectionOfRange@;
{ @kSlantDistance@ * left - of_depth * (1 + 0x1p-20) >= 0
  /\ @kSlantExtent@ * left - (of_depth + 2 * 0x3.001p-24) * (1 + 0x1p-20) >= 0
  /\ @kGridError@ * left - @kProjectionSnap@ * (1 + 0x1p-20) >= 0 }

## identity: rho of the fast path: products u (|b.x c.y| + |b.y c.x|), whose sum is at most u m^2 / 3, against bound
# (a + b + c)^2 / 3 >= a b + b c + c a
(a + b + c) * (a + b + c) - 3 * (a * b + b * c + c * a)
  - ((a - b) * (a - b) + (b - c) * (b - c) + (c - a) * (c - a)) / 2;

## lemma: kFastDepthOfMargin: bound >= kFastProjectionError 2 m m in eight roundings, + 2^-97; underflow 3 * 2^-126
bound = 2 * @kFastProjectionError@ * (1 - 8 * e);            # of m^2
rho = (1 + 4 * e) * e / 3;                                   # of m^2
allowed = (1 + 4 * e) * @kDepthSlackOfMargin@;               # of M: bound times range by the sum
{ @kFastDepthOfMargin@ * (1 - 8 * e) - rho / bound * allowed >= 0
  /\ @kFastProjectionFloor@ * @kFastProjectionFloor@ * @kFastDepthOfMargin@ - 0x9p-126 >= 0 }

## lemma: rho is less than the bound
{ 2 * @kFastProjectionError@ * (1 - 0x1p-20) - e >= 0 }

## lemma: shift by extent, by distance: range <= 2 extent; size <= distance + extent
left = 1 - 16 * e;
once = (1 + 0x1p-16);
{ @kWeightRounding@ * left - once * @kRangeOfDepths@ >= 0
  /\ @kRuleDepthError@ * left - once * (@kSizeOfDepths@ + @kTravel@ + 2 * e) >= 0
  /\ @kDepthError@ * left - once * @kVertexOfPlace@ >= 0 }

## lemma: kVertexError and kDistanceError: of the rows, as D has them, with 2 u of extent for differences of z
left = 1 - 32 * e;
{ @kVertexError@ * left - (@kVertexOfEdges@ + 2 * e) * (1 + 0x1p-10) >= 0
  /\ @kDistanceError@ * left - @kVertexOfRange@ * (1 + 0x1p-10) >= 0 }

## lemma: s + rho_det <= 1.6 slope / kSteepError: by size, by R z, by the rows and by N
# of size: 2 u of x, u of moving to the middle, 2 u of differences; of R z: X z of both rows, moving, 4 u
r = 1.02;                                     # 1 + rho_det, for slope <= kMostSlope
size = (@kVertexOfPlace@ + e + 2 * e) * r + 10.001 * e * r;
shear = (2 * (@kVertexOfPlace@ + @kVertexOfPlace@ + e) + 4 * e) * r;
{ 1.6 * (@kLateralError@ + @kPlaneError@) * (1 - 32 * e) - size >= 0
  /\ 1.6 * @kShearError@ * (1 - 32 * e) - shear >= 0
  /\ 1.6 - r >= 0 }

## lemma: rho_det <= 0.02: 10 u size gradient, of which slope has kSteepError (kLateralError + kPlaneError)
t = @kMostSlope@ / @kSteepError@;
share = 10.001 * e / (@kLateralError@ + @kPlaneError@);
{ share * t / (1 - share * t) <= 0.02 }

## lemma: 1 / (1 - 1.6 t - y) <= 1 + kSteepError t + kRuleDepthFactor y, y = q shift
# (1 - 1.6 t - y) (1 + k t + f y) - 1 = t (k - 1.6 - 1.6 k t) + y (f - 1 - f y - (k + 1.6 f) t)
y = g * (@kFarDepth@ / @kRuleDepthFactor@);
k = @kSteepError@ * (1 - 0x1p-20);
f = @kRuleDepthFactor@ * (1 - 0x1p-20);
{ t in [0, 0.015] /\ g in [0, 1]
  -> k - 1.6 - 1.6 * k * t >= 0 /\ f - 1 - f * y - (k + 1.6 * f) * t >= 0 }

## identity: that is the product
(1 - 1.6 * t - y) * (1 + k * t + f * y) - 1
  - (t * (k - 1.6 - 1.6 * k * t) + y * (f - 1 - f * y - (k + 1.6 * f) * t));

## lemma: a certain hit is beyond the rule's error: q c2 < 1, range = r size, r <= 2, by size = 1
least = @kRuleDepthFactor@ * (1 - 1.6 * 0.015) * (1 - 0x1p-16);
{ r in [0, 2]
  -> least * (@kWeightRounding@ * r + @kRuleDepthError@) - (@kRangeOfDepths@ * r + @kSizeOfDepths@ + e)
     - (@kWeightRounding@ * r + @kMeanRounding@) * (1 + 0x1p-16) >= 0 }

## lemma: t <= 0.015
{ 0.015 * @kSteepError@ - @kMostSlope@ >= 0 }

## lemma: what is off in q itself (place, roundings) counts by (1 - 1.6 t) / (1 - 1.6 t - y)^2
y = g * (@kFarDepth@ / @kRuleDepthFactor@);
{ t in [0, 0.015] /\ g in [0, 1]
  -> (1 - 1.6 * t) / ((1 - 1.6 * t - y) * (1 - 1.6 * t - y)) - @kRayDepthError@ * (1 - 0x1p-10) <= 0 }

## lemma: q c2 of the exact plane
# 1 - g - g (1 - g) / kRayDepthError, as a product
{ g in [0, 1] -> (1 - g) * (1 - g / @kRayDepthError@) >= 0 }

## lemma: a computed q below 0: kRayDepthError d less c1 al d, against (1 - al) d and its own error
{ al in [0, 1]
  -> (@kRayDepthError@ * (1 - 0x1p-10) - al * (1 + @kMostSlope@ + @kReciprocalRounding@))
     - (1 - al) * (1 + @kMostSlope@ + @kReciprocalRounding@ + @kFarDepth@) >= 0 }

## lemma: kGradientRounding, that much: a's part, with n_z = middle - X; b's has fewer roundings
of_x = (1 + na) * (1 + pa) * (1 + r1) - (1 + nc) * (1 + pc) * (1 + q2) * (1 + q4) * (1 + r3);
of_m = (1 + nc) * (1 + pc) * (1 + q2) - (1 + na) * (1 + pa) * (1 + q3);
off = (X * of_x + m * (of_m * ((1 + q4) * (1 + r3)))) * ((1 + r4) * (1 + t));
{ |na| <= 0x1p-23 /\ |nc| <= 0x1p-23 /\ rounded(pa, pc, r1, r3, r4, q2, q3, q4, t) /\ |X| <= 33
  /\ |m| <= 33 -> |1.4 * off / @kGradientRounding@| <= 1 }

## lemma: kReciprocalRounding, that much: of q itself and det's terms
whole = (1 + nc) * (1 + pc) * (1 + q2) * (1 + q4) * (1 + r3) * (1 + r4) * (1 + t) * (1 + d) - 1;
{ |nc| <= 0x1p-23 /\ rounded(pc, r3, r4, q2, q4, t, d)
  -> |1.4 * (whole + 5.01 * e) / @kReciprocalRounding@| <= 1 }

## lemma: without fused operations: 16 u and 24 u of products, that much
# Of det (in slope), and of q (in c0).
r = 1.02;
{ 1.6 * @kUnfusedDepth@ / @kSteepError@ * (1 - 32 * e) - 24.01 * e * r >= 0
  /\ @kUnfusedDepth@ * (1 - 32 * e) - @kRayDepthError@ * 24.01 * e >= 0 }

## lemma: kRestOfNormal 2^-6 of kShareOfDepth 2^-7 is more than c is off; and 6 u of `rows`
{ 0x1p-13 * (1 - 16 * e) - @kGradientRounding@ * (1 + 0x1p-10) >= 0
  /\ (0x1p-6 - 0x1p-7) * (1 - 16 * e) - 8 * e >= 0 }

## lemma: denormals, kept or not: 3 * 2^-126 a component of n, of det by (1 + size + z); of q by 67 of that
# over |det|, times z. q >= 0.97 / z_size at a hit. Left out of kReciprocalRounding: 0.1 u.
{ 4 * 0x1p-126 / @kLeastSlantVolume@ * 2 - 0.1 * e <= 0
  /\ 67 * 3 * 0x1p-126 / @kLeastSlantVolume@ / 0.97 - 0.1 * e <= 0
  /\ @kLeastSlantVolume@ - @kLeastVolume@ >= 0 }
