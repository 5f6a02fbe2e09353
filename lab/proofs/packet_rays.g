# Rays against those that a packet takes them for.
#
#   bounds       a camera's ray from the middle of its pixel: pixel_error; a light's ray
#                from its place in the plane: 16 u of the largest (place_error); 1 / (tfar z): kEndError of
#                itself; a stored ray from its place: place_error_of; 1 / (t z) of a hit:
#                hit_depth_error
#   code         pixel_error, place_error_of (cpu/packet/camera_rays-inl.h), make_light_block, place_error
#                (cpu/packet/light_packet-inl.h), hit_depth_error (cpu/packet/camera_candidates-inl.h)
#   inputs       camera: e = (e0, e1, e2) the error of a direction in the frame's rows.
#                A light's: |d| components below 2, z > 1/4 its component on an axis; origins of
#                planes up to 1; shears up to 1
#   operations   fl(fl(corner + fl(du x)) + fl(dv y)), scaled by a power of two and put on a grid;
#                (row_0 (d_i - origin_0 z) + row_1 (d_j - origin_1 z)) fl(1 / z), fused; (d.xy - shear d.z) / z
#   used by      packet_edges.g, packet_rectangles.g as ray_error
#   by hand      Magnitudes over a tile are largest in its corners. The rows are c times those of unit
#                vectors across a mean whose component on the axis is c >= 1 / sqrt(3), so they stretch
#                by at most c and at least c^2: both terms of x add up to at most sqrt(2) / c times the
#                largest. Rows in double are within 2^-40
#                row_size of place_error, second orders included. Without fused operations: u |origin z|
#                over z, within 2^-19 row_size.
#
# step 0.5: kEndError kStoredPlaceRounding kHitDepthRounding kHitDotRounding

## identity: a camera's direction: products p, q and sums s, t
((c + a * (1 + p)) * (1 + s) + b * (1 + q)) * (1 + t) - (c + a + b)
  - (a * (p * (1 + s) * (1 + t)) + b * (q * (1 + t)) + (c + a) * (s * (1 + t)) + (c + a + b) * t);

## lemma: each of the four by less than 1.001 u
{ rounded(p, q, s, t) -> |p * (1 + s) * (1 + t)| <= 0x1.004p-24 /\ |q * (1 + t)| <= 0x1.004p-24
  /\ |s * (1 + t)| <= 0x1.004p-24 }

## lemma: the grid: 2^-46 of what is at least 1 on the largest axis
{ @FLT(x, 24) /\ |x| <= 0x1p-23 -> |float<24,-149,ne>(x + 0x1.8p-22) - (x + 0x1.8p-22)| <= 0x1p-46 }

## identity: (X + e0) / (1 + e2) - X = (e0 - X e2) / (1 + e2)
(X + e0) - X * (1 + e2) - (e0 - X * e2);

## lemma: a light's ray: sqrt(2) sqrt(3), a difference, a product, a sum, 1 / z and a product
five = (1 + a) * (1 + b) * (1 + c) * (1 + d) * (1 + w) - 1;
{ rounded(a, b, c, d, w) -> sqrt(2) * sqrt(3) <= 2.45 /\ |2.45 * five| <= 0x1p-20 }

## lemma: kEndError: 1 / z, a division, and a product
host = (1 + a) * (1 + b) * (1 + c) - 1;
{ rounded(a, b, c) -> |host / @kEndError@| <= 1 }

## lemma: a stored ray: rows[0] d has three roundings in double and one of the difference, X (rows[2] d) five
four = (1 + a) * (1 + b) * (1 + c) * (1 + d) - 1;
five = (1 + a) * (1 + b) * (1 + c) * (1 + d) * (1 + w) - 1;
{ |a| <= 0x1p-53 /\ |b| <= 0x1p-53 /\ |c| <= 0x1p-53 /\ |d| <= 0x1p-53 /\ |w| <= 0x1p-53
  -> |four / @kStoredPlaceRounding@| <= 1 /\ |five / @kStoredPlaceRounding@| <= 1 }

## lemma: z of a hit: a row, a product and three sums; 1 / (t z): a product and a quotient
five = (1 + a) * (1 + b) * (1 + c) * (1 + d) * (1 + w) - 1;
two = (1 + a) * (1 + b) - 1;
{ rounded(a, b, c, d, w) -> |five / @kHitDotRounding@| <= 1 /\ |two / @kHitDepthRounding@| <= 1 }
