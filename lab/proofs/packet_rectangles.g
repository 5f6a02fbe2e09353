# Where triangles and boxes are seen in a packet's plane.
#
#   bounds       a ray of the packet that hits a triangle is taken for one within the rectangle of its
#                projected vertices, out by kQuotientError of its ends and by kRectangleError
#                (leaf_error / z_least + ray_error) + kRectangleRounding; rows of boxes hold those of
#                their triangles' displaced vertices with kBoxError row_size size; a box with n.p <
#                -kWedgeMargin size in all its points has no point of a ray
#   code         find_rectangles, PixelRange (cpu/packet/triangle_setup-inl.h), find_active
#                (cpu/packet/camera_packet-inl.h),
#                project_boxes, rectangle_of_box, set_wedges, may_have_wedges, outside_wedges
#                (cpu/packet/packet_plane-inl.h)
#   inputs       z_least > 2^-10 z_size + 16 leaf_error, so that all displaced z are positive and a ray
#                is a mean of the x'_k / z'_k; vertices as in packet_vertices.g; |X| <= R = 33
#   operations   x fl(1 / z); low - kQuotientError |low| - margin; sums with
#                places up to 64; six sums of a box's planes times rows
#   used by      packet_edges.g, packet_volume.g (rays of the rectangle)
#   by hand      Of a vertex with |x' / z'| > R, R z' in place of x' shows that it stays beyond. Its
#                errors other than leaf_error are 2 u of x, in kQuotientError, and 2 u R z by X z. The
#                rule displaces a vertex on two axes by kProjection times its way off the ray, at
#                most twice its largest coordinate. side z is rounded in rectangle_of_box: u R z, less than
#                R times what z's own error leaves. Wedges: with rows that are the inverse of A but for E,
#                d = z A (X, Y, 1) - E d. The first is a mean of the corners c_k (bilinear in X, Y, which
#                the frame's bounds hold for the exact direction). A product of rows and axes is off by
#                18 v S and the determinant by 36 v S (v = 2^-53, S the product of the axes' sizes), so
#                that |E| <= (3 * 18 + 36) v / kLeastWedgeSpan < 2^-18. |n| = 1 in sum, and n.c_k >= 0 was
#                found in double, with |c_k| <= 70 |d| (kMostWedgeDepths, and corners up to 35.5 from the
#                middle). Of a camera's axis_z the double roundings are 2^-27 of those of a direction's
#                floats, which are at most (2 / 33 + 2 / 33 + 1 / 2) 64 |d| (kMostPixelError,
#                kMostDepthError). In all n.d >= -2^-17 |d| with n in double. A hit is off its ray by
#                kProjection and kProjectionOfRange of twice its largest coordinate, and a snap of 2^-22 of
#                it.
#
# step 0.85: kRectangleError
# step 0.5: kQuotientError kRectangleRounding kBoxError
# step 0.001: kWedgeMargin
# step 0.1: kLeastWedgeSpan
# step 100: kMostWedgeDepths
# step 0.99999: kNearestByDepth

## identity: x^ / z^ - X' = (X' e_z - e_x) / z^ where x^ + e_x = X' (z^ + e_z)
(X * (z + ez) - ex) - X * z - (X * ez - ex);

## lemma: the quotient, x itself, and two sums with the end
c = (1 + x) * (1 + d) * (1 + m) * (1 + s) * (1 + t) - 1;
{ |x| <= @kVertexOfPlace@ /\ rounded(m, s, t, d) -> |c / @kQuotientError@| <= 1 }

## lemma: kRectangleError: 1 / z and the margin itself (of 2.5 ulp); kRectangleRounding: X z, the place
# of a pixel added, and the margin's sum
{ @kRectangleError@ * (1 - 16 * e) - 1 >= 0
  /\ @kRectangleRounding@ * (1 - 16 * e) - (33 * @kVertexOfPlace@ + 64 * e + 33 * e) >= 0 }

## lemma: boxes: difference, row, product, two sums and that with the error; displacement
five = up^6 - 1;
off = five + 2 * @kProjection@ + @kProjectionOfRange@ + 0x1p-62;
{ @kBoxError@ * (1 - 4 * e) - off >= 0 }

## lemma: quotients of boxes: 1.00001 and 0.99999, division and two products
{ @kNearestByDepth@ * down^3 - 1 >= 0 /\ 1 - 0.99999 * up^3 >= 0 }

## lemma: wedges: rows against axes; corners and axis_z in double
v = 0x1p-53;
{ (3 * 18 + 36) * v * (1 + 0x1p-20) / @kLeastWedgeSpan@
  + (0x1p-27 * (2 * 2 / 33 + 0.5) + 10 * v) * @kMostWedgeDepths@ <= 0x1p-17 }

## lemma: wedges: difference, two products with sums; n as floats, twice by |d|; the limit's product
three = up^3 - 1;
{ @kWedgeMargin@ * (1 - 2 * e) - (three * up + e + 2 * @kProjection@ + 2 * @kProjectionOfRange@ + 0x1p-22 + 0x1p-17) >= 0 }
