# 1/z of a triangle in a packet of a device against that of the rule's hit (CPU: packet_slant.g).
#
#   bounds       |1/z of the rule - q| <= c0 + q (c1 + q c2), q = n.(X, Y, 1) / det as computed
#   code         set_up_depth (shaders/packet/triangle_setup.glsl), rule_depth (shaders/packet/depth_bounds.glsl),
#                nearest_q (shaders/packet/packet.glsl, cpu/packet/packet_frame-inl.h)
#   constants    kSteepError, kPlaneError (of c1, by gradient), kGradientRounding (c0, by gradient),
#                kReciprocalRounding (c1), kRuleDepthFactor, kRuleExtentError, kNarrowDepth (by_q,
#                by_q2), kNearestByDepth
#   inputs       theta = gradient times how far the mean g of the vertices under the hit's weights is
#                off the ray; |det| > kKnownVolume det_error (packet_volume.g), and in (kLeastVolume,
#                kMostVolume), so that scale = 1 / |det| with one rounding. On a device the
#                determinant of the packet's directions is beyond kLeastVolume, too, or by_q unused.
#   by hand      |n_x| + |n_y| <= 6 size z, since n is the sum of the edge functions (packet_edges.g).
#                Rounded differences are those of a triangle whose other two vertices are off by u of
#                an edge: 2 u (size + half_extent z) <= 2 u L, and <= 2 u size + 4 u R z, beside the
#                ray; 2 u s_z extent in z. det rounds by five factors more, of terms that are at most
#                |det| + 2 size max(|n_x|, |n_y|). sum(w_k |edge_k|) <= 2/3 of the longest edge: the
#                displacement of z is kProjection times 8/3 extent, and 2 u of z_k makes 2 u of z.
#                The rule's error is (kRangeOfDepths R + (kSizeOfDepths + kTravel) Z) / D_r + K z, K = 2 r1 (M + 2 r1) R scale / volume:
#                shaders/packet/depth_bounds.glsl. X, Y and the middle are up to R = 33.
#
# step: kSteepError 0.75
# step: kPlaneError 0.5
# step: kGradientRounding 0.5
# step: kReciprocalRounding 0.5
# step: kRuleDepthError 0.7
# step: kRuleDepthFactor 0.9
# step: kWeightRounding 0.5
# step: kRuleExtentError 0.5
# step: kNarrowDepth 2
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

## lemma: theta <= 0.22: of error, by L error z; of the differences, by L^2 z
# Needs of extent, size and R z, relative to what `error` has of each.
u = 0x1p-24;
{ 6 / (@kKnownVolume@ * @kVolumeError@) * (@kVertexOfExtent@ / @kExtentError@) <= 0.195
  /\ 6 / (@kKnownVolume@ * @kVolumeError@) * (3.0003 * u / @kLateralError@) <= 0.195
  /\ 6 / (@kKnownVolume@ * @kVolumeError@) * (10.001 * u / @kShearError@) <= 0.195
  /\ 6 * 2.001 * u / (@kKnownVolume@ * @kVolumeRounding@) <= 0.025 }

## lemma: kSteepError and kPlaneError: theta / (1 - theta) by extent, size and R z, and det's roundings
u = 0x1p-24;
most = 1 / (1 - 0.44);
left = @kSteepError@ * (1 - 0x1p-20);
{ left * @kExtentError@ - most * @kVertexOfExtent@ >= 0
  /\ left * @kShearError@ - most * 14.001 * u >= 0
  /\ left * (@kLateralError@ + @kPlaneError@) - (most * 5.001 + 10.001) * u >= 0 }

## lemma: kGradientRounding: a's part, with n_z = middle - X; b's has fewer roundings
# n: of normals (2 u), p: times scale, q, r: as in packet_edges.g; with those of the whole
of_x = (1 + na) * (1 + pa) * (1 + r1) - (1 + nc) * (1 + pc) * (1 + q2) * (1 + q4) * (1 + r3);
of_m = (1 + nc) * (1 + pc) * (1 + q2) - (1 + na) * (1 + pa) * (1 + q3);
off = (X * of_x + m * (of_m * ((1 + q4) * (1 + r3)))) * ((1 + r4) * (1 + t));
{ |na| <= 0x1p-23 /\ |nc| <= 0x1p-23 /\ |pa| <= @kRounding@ /\ |pc| <= @kRounding@
  /\ |r1| <= @kRounding@ /\ |r3| <= @kRounding@ /\ |r4| <= @kRounding@ /\ |q2| <= @kRounding@
  /\ |q3| <= @kRounding@ /\ |q4| <= @kRounding@ /\ |t| <= @kRounding@ /\ |X| <= 33 /\ |m| <= 33
  -> |off / @kGradientRounding@| <= 1 }

## lemma: kReciprocalRounding: of q itself (division of 2.5 ulp), det's terms, and 2 u of z
whole = (1 + nc) * (1 + pc) * (1 + q2) * (1 + q4) * (1 + r3) * (1 + r4) * (1 + t) * (1 + d) - 1;
{ |nc| <= 0x1p-23 /\ |pc| <= @kRounding@ /\ |r3| <= @kRounding@ /\ |r4| <= @kRounding@
  /\ |q2| <= @kRounding@ /\ |q4| <= @kRounding@ /\ |t| <= @kRounding@ /\ |d| <= 0x5p-24
  -> |(whole + 5.01 * @kRounding@ + 2.001 / (1 - 0.44) * @kRounding@) / @kReciprocalRounding@| <= 1 }

## lemma: narrowed: the sum of the rule's edge functions by scale, fast ones, other rounding, 1 / (1 - x)
u = 0x1p-24;
by_z = 12 * 0x7.001p-24 + 3 * (@kVertexOfPlace@ + 1.001 * u + @kVertexOfRange@ * 0x1p18);
least = 1 - (6.001 / @kVolumeError@) / @kKnownVolume@;
least_z = 1 - by_z / @kVolumeRounding@ / @kKnownVolume@;
least_extent = 1 - 61.52 * u / @kVolumeExtentError@ / @kKnownVolume@;
once = (1 + 3 * 0x1p-6) * 1.01 / (1 - @kNarrowDepth@);
{ @kRuleDepthFactor@ * least - once >= 0 /\ @kRuleDepthFactor@ * least_z - once >= 0
  /\ @kRuleDepthFactor@ * least_extent - once >= 0 }

## lemma: narrowed: the mean and the float z, and what grows with the extent, first vertex included
u = 0x1p-24;
once = (1 + 0x1p-16) / (1 - @kNarrowDepth@);
{ @kRuleDepthError@ - once * (@kSizeOfDepths@ + @kTravel@ + u + @kVertexOfRange@ * 0x1p18) >= 0
  /\ @kWeightRounding@ - once * @kRangeOfDepths@ >= 0
  /\ @kRuleExtentError@ - once * (@kVertexOfEdges@ + 8 * @kProjection@ / 3 + 2 * u
                                  + 3 * @kVertexOfRange@) >= 0 }

## lemma: narrowed: (1 / (1 - theta)^2 - 1) x <= what kSteepError leaves by R z, times theta
{ t in [0, 0.22]
  -> (2 - t) / ((1 - t) * (1 - t)) * @kNarrowDepth@
     - (@kSteepError@ * @kShearError@ / 0xe.001p-24 - 1 / (1 - t)) <= 0 }

## lemma: not narrowed: 1 / (1 - theta - y) <= 1 + 1.9 theta + kRuleDepthFactor y, y = q depth_error, k y <= kFarDepth
# (1 - theta - y) (1 + 1.9 theta + k y) - 1 = theta (0.9 - 1.9 theta - (1.9 + k) y) + y (k - 1 - k y)
y = g * (@kFarDepth@ / @kRuleDepthFactor@);
{ t in [0, 0.22] /\ g in [0, 1]
  -> 0.9 - 1.9 * t - (1.9 + @kRuleDepthFactor@) * y >= 0
  /\ @kRuleDepthFactor@ - 1 - @kRuleDepthFactor@ * y >= 0 }

## lemma: that is the product
{ (1 - t - y) * (1 + 1.9 * t + k * y) - 1 - (t * (0.9 - 1.9 * t - (1.9 + k) * y) + y * (k - 1 - k * y))
  in [0, 0] }
(1 - t - y) * (1 + 1.9 * t + k * y) - 1 - (t * (0.9 - 1.9 * t - (1.9 + k) * y) + y * (k - 1 - k * y)) -> 0;

## lemma: kSteepError is 1.9 times what is needed by R z
{ @kSteepError@ * @kShearError@ * (1 - 0x1p-20) - 1.9 * 0xe.001p-24 >= 0 }

## lemma: kNearestByDepth: division of 2.5 ulp, and that of what was subtracted (kDepthError has more)
e = @kRounding@;
{ @kNearestByDepth@ * (1 - 5 * e) * (1 - 2 * e) - 1 >= 0
  /\ @kDepthError@ * (1 - 16 * e) - @kVertexOfPlace@ - e >= 0 }
