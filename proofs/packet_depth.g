# 1/z of a triangle in a packet of a device against that of the rule's hit (CPU: packet_slant.g).
#
#   bounds       |1/z of the rule - q| <= c0 + q (c1 + q c2), q = n.(X, Y, 1) / det as computed
#   code         set_up_depth (shaders/packet/triangle_setup.glsl), rule_depth (shaders/packet/depth_bounds.glsl),
#                nearest_q (shaders/packet/packet.glsl, cpu/packet/packet_frame-inl.h)
#   constants    kSteepError (of c1, by slope), kReciprocalRounding, kDeviceRounding (c1), kDeviceSlopeRounding
#                (c0, by slope), kRuleDepthFactor, kNarrowWeights, kNarrowDepth (by_q, by_q2), kNearestByDepth
#   inputs       theta = gradient times how far the mean g of the vertices under the hit's weights is
#                off the ray; |det| > kKnownVolume det_error (packet_volume.g), and in (kLeastVolume,
#                kMostVolume), so that scale = 1 / |det| with one rounding. On a device the
#                determinant of the packet's directions is beyond kLeastVolume, too, or by_q unused.
#   by hand      |n_x| + |n_y| <= 6 size z, since n is the sum of the edge functions (packet_edges.g).
#                Rounded differences are those of a triangle whose other two vertices are off by u of
#                an edge: 2 u size + 4 u R z beside the ray; 2 u s_z extent in z. sum(w_k |edge_k|) <= 2/3
#                of the longest edge: the displacement of z is kProjection times 8/3 extent, and 2 u of
#                z_k makes 2 u of z. With W = edge (2 z_range size + edge z_size) / |det|, the normal
#                (four factors of two products each) and det (seven) without fused operations: det by
#                14 u W, so rho; n_z by 8 u edge^2, so delta of q_most, since z_size q_most >= (1 - theta)
#                (1 - rho - delta) >= 0.77; n_x, n_y by 8 u edge z_range, of which c0 has twice as much.
#                So q of the exact plane is at most (1 + e) q_most, 1 + e = (1 + rho) (1 + delta), and c1
#                has `rounding` = kDeviceRounding W, at least 1.298 e.
#                q_most bounds q for the exact ray, what rounds by slope included, or 1/z_G (1.001 /
#                z_least): neither has a second order. X, Y and the middle are up to 18 (beyond that
#                ray_error is larger).
#                The rule's error is (kRangeOfDepths R + (kSizeOfDepths + kTravel) Z) / D_r + K z, K = 2 r1 (M + 2 r1) R scale / volume:
#                shaders/packet/depth_bounds.glsl.
#
# step: kSteepError 0.75
# step: kDeviceRounding 0.9
# step: kDeviceSlopeRounding 0.5
# step: kNarrowWeights 0.7
# step: kReciprocalRounding 0.5
# step: kRuleDepthError 0.7
# step: kRuleDepthFactor 0.7
# step: kWeightRounding 0.5
# step: kExtentError 0.5
# step: kNarrowDepth 3
# step: kFarDepth 2
# step: kVolumeError 0.5
# step: kKnownVolume 0.5
# step: kLeastVolume 0.000000001
# step: kMostVolume 10000
# step: kNearestByDepth 0.99999

## lemma: q = (1 - n.g / det) / z_G, if n.(X z_G + g_x, Y z_G + g_y, z_G) = det
{ (nx * (x * zg + gx) + ny * (y * zg + gy) + nz * zg) - (nx * gx + ny * gy) - zg * (nx * x + ny * y + nz)
  in [0, 0] }
(nx * (x * zg + gx) + ny * (y * zg + gy) + nz * zg) - (nx * gx + ny * gy) - zg * (nx * x + ny * y + nz)
  -> 0;

## lemma: scale and directions.volume are normal floats
{ v in [@kLeastVolume@, @kMostVolume@] -> 1 / v in [0x1p-126, 0x1p127] }

## lemma: theta <= 0.202: of error, by L error z, as det is rounded; of differences
# Needs of extent, size and R z, relative to what `error` has of each. Differences are off by u edge in x
# and y, |n_x| + |n_y| <= 4 edge z_range, and edge <= 2 size: 8 u, where `rounding` has 64 u.
u = 0x1p-24;
{ 6 / (@kKnownVolume@ * @kVolumeError@) * (@kVertexOfExtent@ / @kExtentError@) <= 0.195
  /\ 6 / (@kKnownVolume@ * @kVolumeError@) * (3.0003 * u / @kLateralError@) <= 0.195
  /\ 6 / (@kKnownVolume@ * @kVolumeError@) * (10.001 * u / @kShearError@) <= 0.195
  /\ 8.001 * u / (2 * @kDeviceRounding@) * 0x1p-5 <= 0.004
  /\ 0.195 / (1 - 0.0137) + 0.004 <= 0.202 }

## lemma: kSteepError is 1.9 times what is needed by extent, size and R z
left = @kSteepError@ * (1 - 0x1p-20);
{ left * @kExtentError@ - 1.9 * @kVertexOfExtent@ >= 0
  /\ left * @kLateralError@ - 1.9 * 3.0003 * 0x1p-24 >= 0
  /\ left * @kShearError@ - 1.9 * 0xe.001p-24 >= 0 }

## lemma: rho <= 0.0137, delta <= 0.0102, e <= 0.024, 1.298 e <= rounding <= 2^-5
rho = 14.002 * @kRounding@;
delta = 8.001 / 0.77 * @kRounding@;
{ rho / @kDeviceRounding@ * 0x1p-5 <= 0.0137 /\ delta / @kDeviceRounding@ * 0x1p-5 <= 0.0102
  /\ (rho + 1.0137 * delta) / @kDeviceRounding@ * 0x1p-5 <= 0.024
  /\ @kDeviceRounding@ * (1 - 0x1p-20) - 1.298 * (rho + 1.0137 * delta) >= 0
  /\ (1 - 0.202) * (1 - 0.0137 - 0.0102) >= 0.77 }

## lemma: kDeviceSlopeRounding: a's part, with n_z = middle - X; b's has fewer roundings; three sums of met_groups
# n: of normals (2 u), p: times scale, q, r: as in packet_edges.g; with those of the whole
of_x = (1 + na) * (1 + pa) * (1 + r1) - (1 + nc) * (1 + pc) * (1 + q2) * (1 + q4) * (1 + r3);
of_m = (1 + nc) * (1 + pc) * (1 + q2) - (1 + na) * (1 + pa) * (1 + q3);
off = (X * of_x + m * (of_m * ((1 + q4) * (1 + r3)))) * ((1 + r4) * (1 + t));
{ |na| <= 0x1p-23 /\ |nc| <= 0x1p-23 /\ |pa| <= @kRounding@ /\ |pc| <= @kRounding@
  /\ |r1| <= @kRounding@ /\ |r3| <= @kRounding@ /\ |r4| <= @kRounding@ /\ |q2| <= @kRounding@
  /\ |q3| <= @kRounding@ /\ |q4| <= @kRounding@ /\ |t| <= @kRounding@ /\ |X| <= 18 /\ |m| <= 18
  -> |(off + 3 * 36 * @kRounding@) / @kDeviceSlopeRounding@| <= 0.85 }

## lemma: kReciprocalRounding: of q itself (division of 2.5 ulp), det's terms, and 2 u of z
whole = (1 + nc) * (1 + pc) * (1 + q2) * (1 + q4) * (1 + r3) * (1 + r4) * (1 + t) * (1 + d) - 1;
{ |nc| <= 0x1p-23 /\ |pc| <= @kRounding@ /\ |r3| <= @kRounding@ /\ |r4| <= @kRounding@
  /\ |q2| <= @kRounding@ /\ |q4| <= @kRounding@ /\ |t| <= @kRounding@ /\ |d| <= 0x5p-24
  -> |(whole + 5.01 * @kRounding@ + 2.001 / (1 - 0.44) * @kRounding@) / @kReciprocalRounding@| <= 1 }

## lemma: narrowed: the sum of the rule's edge functions by scale, fast ones, other rounding, 1 / (1 - x)
# The error of the volume is that of extents (3 L z_error), of error and of its own roundings.
u = 0x1p-24;
by_vertex = 3 * (@kVertexOfPlace@ + 1.001 * u + @kVertexOfRange@ * 0x1p18) / (3 * @kDepthError@);
once = (1 + 3 * 0x1p-6) * 1.01 / (1 - @kNarrowDepth@);
{ @kNarrowWeights@ * (1 - 6.001 / @kVolumeError@ / @kKnownVolume@) - once >= 0
  /\ @kNarrowWeights@ * (1 - by_vertex / @kKnownVolume@) - once >= 0
  /\ @kNarrowWeights@ * (1 - 61.52 * u / (3 * @kExtentError@) / @kKnownVolume@) - once >= 0
  /\ @kNarrowWeights@ * (1 - 14.002 * u / @kDeviceVolumeRounding@ / @kKnownVolume@) - once >= 0 }

## lemma: narrowed: the mean and the float z, and what grows with the extent, first vertex included
u = 0x1p-24;
once = (1 + 0x1p-16) / (1 - @kNarrowDepth@);
{ @kRuleDepthError@ - once * (@kSizeOfDepths@ + @kTravel@ + u + @kVertexOfRange@ * 0x1p18) >= 0
  /\ @kWeightRounding@ - once * @kRangeOfDepths@ >= 0
  /\ @kExtentError@ * (1 - 0x1p-20) - once * (@kVertexOfEdges@ + 8 * @kProjection@ / 3 + 2 * u
                                  + 3 * @kVertexOfRange@) >= 0 }

## lemma: narrowed: (1 + e)^2 x / (1 - t)^2 + (1 + e) / (1 - t) - 1 <= x + 1.9 (1 - e) t + 1.298 e, x <= kNarrowDepth
# At t = 0, and what t adds, by t.
{ t in [0, 0.202] /\ e in [0, 0.024]
  -> 0.298 - (2 + e) * @kNarrowDepth@ >= 0
  /\ (1 + e) * (1 + e) * @kNarrowDepth@ * (2 - t) / ((1 - t) * (1 - t)) + (1 + e) / (1 - t) - 1.9 * (1 - e) <= 0 }

## lemma: not narrowed: 1 / ((1 - t) (1 - e) - y) <= 1 + 1.9 (1 - e) t + kRuleDepthFactor y + 1.298 e
# y = q depth_error, k y <= kFarDepth; 1 / (1 + e) >= 1 - e. The coefficients of t, y and e in the product:
y = g * (@kFarDepth@ / @kRuleDepthFactor@);
k = @kRuleDepthFactor@;
a = 1.9 * (1 - e);
{ t in [0, 0.202] /\ e in [0, 0.024] /\ g in [0, 1]
  -> (a - 1 - a * t - (a + k) * y - 1.298 * e) - e * (a - 1 - a * t - k * y - 1.298 * e) >= 0
  /\ (k - 1 - k * y) - e * (k + 1.298) >= 0 /\ 0.298 - 1.298 * e >= 0 }

## lemma: that is the product
{ ((1 - t) * (1 - e) - y) * (1 + a * t + k * y + c * e) - 1
  - (t * ((a - 1 - a * t - (a + k) * y - c * e) - e * (a - 1 - a * t - k * y - c * e))
     + y * ((k - 1 - k * y) - e * (k + c)) + e * (c - 1 - c * e)) in [0, 0] }
((1 - t) * (1 - e) - y) * (1 + a * t + k * y + c * e) - 1
  - (t * ((a - 1 - a * t - (a + k) * y - c * e) - e * (a - 1 - a * t - k * y - c * e))
     + y * ((k - 1 - k * y) - e * (k + c)) + e * (c - 1 - c * e)) -> 0;

## lemma: kNearestByDepth: division of 2.5 ulp, and that of what was subtracted (kDepthError has more)
e = @kRounding@;
{ @kNearestByDepth@ * (1 - 5 * e) * (1 - 2 * e) - 1 >= 0
  /\ @kDepthError@ * (1 - 16 * e) - @kVertexOfPlace@ - e >= 0 }
