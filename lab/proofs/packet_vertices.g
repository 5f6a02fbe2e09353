# The vertices of a packet against those that the rule displaces.
#
#   bounds       |x - X z| and |y - Y z| of a vertex, taken together, are off by at most
#                error = kLateralError size + kShearError R z_size
#                      + row_sizes (kExtentError extent + kDistanceError distance + kGridError),
#                z by kDepthError z_size + s_z (the same bracket)
#   code         project_vertices, find_laterals (cpu/packet/triangle_setup-inl.h)
#   inputs       rows M, taken for exact; s_x, s_y, s_z the sums of their magnitudes; extent the
#                largest coordinate of a vertex less the leaf's first one; distance the largest of the
#                first one; |X|, |Y|, the middle's too, at most R; a ray through the triangle, or
#                through that of the displaced vertices
#   operations   d = fl(v - v0); E = sum of fl(row) d, fused or not; H from double;
#                x = fl(E + fl(H)); x - middle z, fused or not
#   used by      packet_edges.g, packet_volume.g, packet_slant.g, packet_rectangles.g
#   by hand      Of the three rows in E one has five factors. A device's row leaves out rho u of
#                itself: 1.5 for sheared_axis; for move_row 1 + middle s_z / s_x, for which there is
#                room up to 6.5. A vertex is the mean of its edges to the others, up to 2 extent on
#                an axis, so it is at most 4 extent off the ray along an axis of space, and the rule
#                displaces it on two axes by kProjection times that (project.g). |x| is at most |x -
#                middle z| + R |z|. Second orders of the errors themselves are left to the spare parts.
#
# step 0.75: kExtentError
# step 0.5: kDistanceError kLateralError kShearError kDepthError
# step 0.49: kGridError
# kGridError: kProjectionSnap is doubled itself

## identity: x by edges and the first vertex: what is relative to x, and what to the edges
# dE: error of the edges' sum, q: that of the first vertex, f: of the last sum
(E + dE + H * (1 + q)) * (1 + f) - (E + H)
  - ((E + H) * (f + q * (1 + f)) + (dE - q * E) * (1 + f));

## lemma: their sizes: difference, row (1.5 on a device), product, two sums; the extent is rounded too
c = (1 + d) * (1 + r) * (1 + p) * (1 + s) * (1 + t) - 1;
{ rounded(d) /\ |r| <= 0x1.8p-24 /\ rounded(p, s, t) /\ |q| <= 0x1.0001p-24 /\ rounded(f)
  /\ |g| <= 0x1p-23 -> |f + q * (1 + f)| <= @kVertexOfPlace@
  /\ |(c - q) * (1 + f) * (1 + g)| <= @kVertexOfEdges@ }

## lemma: with the displacement by four extents
off = @kVertexOfEdges@ + 4 * @kProjection@ * (1 + 0x1p-20) + @kProjectionOfRange@;
{ @kVertexOfExtent@ - off >= 0 /\ @kExtentError@ * (1 - 16 * e) - @kVertexOfExtent@ >= 0 }

## lemma: the first vertex from double: difference, row times it, sums; and the displacement
v = 1 + 0x1p-53;
double = v^5 - 1;
{ @kVertexOfRange@ - (double + @kProjectionOfRange@ * (1 + 0x1p-20)) >= 0 }

## lemma: the first vertex from accurate_dot, and the displacement, relative to a row times distance
# In turn the sums of errors: of two and three products, with those of two sums, of the row (1.5 u)
# and of the point; each of the six is rounded. Then what both dot3 round, and move_row twice.
once = 1 + 4 * e;
six = (e + e + 2 * e + 3 * e + 4.5 * e + 5.5 * e) * once;
others = (3 * 1.5 * e + 3 * e + 2.5 * e) * once;
{ @kVertexOfRange@ - (e * (six + others) + @kProjectionOfRange@ * (1 + 0x1p-20)) >= 0 }

## lemma: kDistanceError, and kGridError
{ @kDistanceError@ * (1 - 16 * e) - @kVertexOfRange@ >= 0
  /\ @kGridError@ * (1 - 16 * e) - @kProjectionSnap@ >= 0 }

## identity: the middle of the triangle's part, fused (p = 0) or not
(x - m * z * (1 + p)) * (1 + f) - (x - m * z) - ((x - m * z) * f - m * z * p * (1 + f));

## lemma: kLateralError: x itself, moving it, and what `size` rounds; kShearError: x, X z and moving
# x, for both coordinates; kDepthError
moving = e * (1 + 4 * e);
{ @kLateralError@ * (1 - 16 * e) - (@kVertexOfPlace@ + moving) >= 0
  /\ @kShearError@ * (1 - 16 * e) - 2 * (@kVertexOfPlace@ + @kVertexOfPlace@ + moving) >= 0
  /\ @kDepthError@ * (1 - 16 * e) - @kVertexOfPlace@ >= 0 }
