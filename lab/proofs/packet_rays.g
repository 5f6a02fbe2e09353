# Rays against those that a packet takes them for.
#
#   bounds       a camera's ray from the middle of its pixel: pixel_error, find_ray_error; a point's in
#                the plane: (28 + 20 s) s u (NearDirections); 1 / (tfar z): kEndError of itself; a stored ray from its place: place_error_of; 1 / (t z) of a
#                hit: hit_depth_error
#   code         pixel_error (cpu/packet/camera/camera_packet_maker-inl.h),
#                NearDirections (cpu/packet/light/light_packet_directions-inl.h), make_light_block
#                (cpu/packet/light/light_packet_maker-inl.h), place_error
#                (cpu/packet/light/light_packet_plane-inl.h), place_error_of
#                (cpu/packet/camera/stored_packet_maker-inl.h), hit_depth_error
#                (cpu/packet/camera/camera_packet_deferred-inl.h)
#   constants    kDirectionRounding, kEndError,
#                kStoredPlaceRounding, kHitDepthRounding, kHitDotRounding
#   inputs       camera: e = (e0, e1, e2) the error of a direction in the frame's rows, |X| <= 7.5 on a
#                device. Points: |d| components below 2, |x / z|, |y / z| <= s <= 2, z > 1/4; shears
#                up to 1, axes of length 1
#   operations   fl(fl(corner + fl(du x)) + fl(dv y)), scaled by a power of two and put on a grid;
#                l = fl(d_k / c_k), rows (d - l c) + l (rows c), fused; (d.xy - shear d.z) / z
#   used by      packet_edges.g, packet_rectangles.g as ray_error
#   by hand      Magnitudes over a tile are largest in its corners. c differs from axes[2] by u, which
#                makes 24 u^2 of |d - l c| and the sums: within 2^-40 row_size of place_error,
#                that of double included. Without fused operations: u |l c| <= 3.5 u and rows twice,
#                over z > 1/4, within 2^-19 row_size.
#
# step: kDirectionRounding 0.95
# step: kEndError 0.5
# step: kStoredPlaceRounding 0.5
# step: kHitDepthRounding 0.5
# step: kHitDotRounding 0.5

## identity: a camera's direction: products p, q and sums s, t
((c + a * (1 + p)) * (1 + s) + b * (1 + q)) * (1 + t) - (c + a + b)
  - (a * (p * (1 + s) * (1 + t)) + b * (q * (1 + t)) + (c + a) * (s * (1 + t)) + (c + a + b) * t);

## lemma: each of the four by less than 1.001 u
{ |p| <= @kRounding@ /\ |q| <= @kRounding@ /\ |s| <= @kRounding@ /\ |t| <= @kRounding@
  -> |p * (1 + s) * (1 + t)| <= 0x1.004p-24 /\ |q * (1 + t)| <= 0x1.004p-24
  /\ |s * (1 + t)| <= 0x1.004p-24 }

## lemma: the grid: 2^-46 of what is at least 1 on the largest axis
{ @FLT(x, 24) /\ |x| <= 0x1p-23 -> |float<24,-149,ne>(x + 0x1.8p-22) - (x + 0x1.8p-22)| <= 0x1p-46 }

## identity: (X + e0) / (1 + e2) - X = (e0 - X e2) / (1 + e2)
(X + e0) - X * (1 + e2) - (e0 - X * e2);

## lemma: find_ray_error: e0 and 7.5 e2 over 1 - 2^-7 within its e0 + 9 e2, in roundings
left = @kDirectionRounding@ * (1 - 16 * @kRounding@) / 0x1.004p-24;
{ left - 1 / (1 - 0x1p-7) >= 0 /\ 9 * left - 7.5 / (1 - 0x1p-7) >= 0
  /\ 0x1p-20 * @kDirectionRounding@ * (1 - 16 * @kRounding@) * (1 - 0x1p-7) - 0x1p-46 >= 0 }

## lemma: NearDirections: |d - l c| <= sqrt(2) (1 + sqrt(3)) z s
{ sqrt(2) * (1 + sqrt(3)) <= 3.9 }

## lemma: five roundings of it in x and z, five of z, division and product
five = (1 + a) * (1 + b) * (1 + c) * (1 + d) * (1 + e) - 1;
seven = (1 + a) * (1 + b) * (1 + c) * (1 + d) * (1 + e) * (1 + f) * (1 + g) - 1;
{ |a| <= @kRounding@ /\ |b| <= @kRounding@ /\ |c| <= @kRounding@ /\ |d| <= @kRounding@
  /\ |e| <= @kRounding@ /\ |f| <= @kRounding@ /\ |g| <= @kRounding@
  -> |3.9 * five + seven| <= 0x1bp-24 /\ |3.9 * five| <= 0x13.9p-24 }

## lemma: (27 + 19.6 s) s, its second orders included, is within (28 + 20 s) s
u = @kRounding@;
{ s in [0, 2] -> (28 + 20 * s) - (0x1b + 0x13.9p0 * s) * (1 + 64 * u) >= 0 }

## lemma: kEndError: z of NearDirections for s <= 2, two divisions, product
z = (5 + 19.6 * s) * 0x1.001p-24;
host = (1 + c) * (1 + d) * (1 + e) * (1 + z) - 1;
{ |c| <= @kRounding@ /\ |d| <= @kRounding@ /\ |e| <= @kRounding@
  /\ s in [0, 2] -> |host / @kEndError@| <= 1 }

## lemma: a stored ray: rows[0] d has three roundings in double and one of the difference, X (rows[2] d) five
four = (1 + a) * (1 + b) * (1 + c) * (1 + d) - 1;
five = (1 + a) * (1 + b) * (1 + c) * (1 + d) * (1 + e) - 1;
{ |a| <= 0x1p-53 /\ |b| <= 0x1p-53 /\ |c| <= 0x1p-53 /\ |d| <= 0x1p-53 /\ |e| <= 0x1p-53
  -> |four / @kStoredPlaceRounding@| <= 1 /\ |five / @kStoredPlaceRounding@| <= 1 }

## lemma: z of a hit: a row, a product and three sums; 1 / (t z): a product and a quotient
five = (1 + a) * (1 + b) * (1 + c) * (1 + d) * (1 + e) - 1;
two = (1 + a) * (1 + b) - 1;
{ |a| <= @kRounding@ /\ |b| <= @kRounding@ /\ |c| <= @kRounding@ /\ |d| <= @kRounding@
  /\ |e| <= @kRounding@ -> |five / @kHitDotRounding@| <= 1 /\ |two / @kHitDepthRounding@| <= 1 }
