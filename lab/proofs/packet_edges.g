# Edge functions of a packet's vertices: what errors of the vertices and roundings make of them.
#
#   bounds       for a ray of the triangle's rectangle or of a block that it meets, the computed edge
#                function is at most bound = 2 error (reach + error) + kEdgeRounding size
#                (reach + kShearRounding R z_size) + 1.01 ray_error slope from that of the vertices
#                displaced by the rule
#   code         find_edges, store_edges, Planes (cpu/packet/triangle_setup-inl.h), occlude
#                (cpu/packet/light_trace-inl.h), RowPlanes (cpu/packet/camera_packet-inl.h)
#   inputs       vertices as the ray in the middle m sees them, |x| + |y| <= size, |z| <= z_size; a ray
#                (X, Y) with |X|, |Y|, |m| <= R; X' = (X, Y) - m, and size + |X'| z_size <= reach
#   operations   a = A1 - A2, b, c likewise, six products of floats; c - b m_y - a m_x; a X + (b Y + c);
#                or this in the middle of a block, a x + b y of a ray from there, and their sum. Each is
#                fused or not: a product that is fused has the error 0.
#   used by      packet_any.g
#   by hand      |A1| + |A2| + |B1| + |B2| <= 2 size z_size and |C1| + |C2| <= size^2. So an error is
#                at most 2 size z_size times the largest error of a factor of an A or B, and size^2
#                times that of a C. The former are linear in X' and m: proved for each of them as 1.
#                Orders of summation other than that of the CPU give no more. |u x v| <= |u|_1 |v|_oo.
#                What the bound itself rounds has room in packet_vertices.g.
#
# step 0.5: kEdgeRounding kShearRounding kRayError

## identity: errors d and e of both points make l x e + d x m + d x e of their cross product
(lx + dx) * (my + ey) - (ly + dy) * (mx + ex) - (lx * my - ly * mx)
  - ((lx * ey - ly * ex) + (dx * my - dy * mx) + (dx * ey - dy * ex));

## lemma: factors of a ray's edge function, the middle of a block (t) and steps to vectors (n) included
# p: product, s: difference; q1 to q4: moving c; r1 to r4: products with X, Y and their sums
a_lateral = (1 + p) * (1 + s) * (1 + r1) * (1 + r4) * (1 + t) - 1;
b_lateral = (1 + p) * (1 + s) * (1 + r2) * (1 + r3) * (1 + r4) * (1 + t) - 1;
a_middle = (1 + p) * (1 + s) * ((1 + r1) - (1 + q3) * (1 + q4) * (1 + r3)) * (1 + r4) * (1 + t);
b_middle = (1 + p) * (1 + s) * ((1 + r2) - (1 + q1) * (1 + q2) * (1 + q4)) * (1 + r3) * (1 + r4) * (1 + t);
constant = (1 + p) * (1 + s) * (1 + q2) * (1 + q4) * (1 + r3) * (1 + r4) * (1 + t) - 1;
{ rounded(p, s, t, q1, q2, q3, q4, r1, r2, r3, r4) -> |a_lateral| <= @kEdgeLateral@
  /\ |b_lateral| <= @kEdgeLateral@ /\ |a_middle| <= @kEdgeMiddle@ /\ |b_middle| <= @kEdgeMiddle@
  /\ |constant| <= @kEdgeConstant@ }

## identity: the same, written as a sum over X = m + X' for an A, and for a B
(1 + p) * (1 + s) * ((m + l) * (1 + r1) - m * (1 + q3) * (1 + q4) * (1 + r3)) * (1 + r4) * (1 + t) - l
  - (l * ((1 + p) * (1 + s) * (1 + r1) * (1 + r4) * (1 + t) - 1)
  + m * ((1 + p) * (1 + s) * ((1 + r1) - (1 + q3) * (1 + q4) * (1 + r3)) * (1 + r4) * (1 + t)));
(1 + p) * (1 + s) * ((m + l) * (1 + r2) - m * (1 + q1) * (1 + q2) * (1 + q4)) * (1 + r3) * (1 + r4) * (1 + t) - l
  - (l * ((1 + p) * (1 + s) * (1 + r2) * (1 + r3) * (1 + r4) * (1 + t) - 1)
  + m * ((1 + p) * (1 + s) * ((1 + r2) - (1 + q1) * (1 + q2) * (1 + q4)) * (1 + r3) * (1 + r4) * (1 + t)));

## lemma: kEdgeRounding: |X'| z <= reach - size, so 2 size |X'| z and size^2 are within size reach;
# kShearRounding: the middle, and what ray_error <= R times slope rounds
left = 1 - 16 * e;
{ @kEdgeRounding@ * left - 2 * @kEdgeLateral@ >= 0 /\ @kEdgeRounding@ * left - @kEdgeConstant@ >= 0
  /\ @kEdgeRounding@ * @kShearRounding@ * left - (2 * @kEdgeMiddle@ + 4 * e * (1 + 2 * e)) >= 0 }

## identity: the normal is the sum of the edge functions: n_x of the a, n_y of the b, n_z of the c
(y1 - y0) * (z2 - z0) - (z1 - z0) * (y2 - y0)
  - ((y1 * z2 - z1 * y2) + (y2 * z0 - z2 * y0) + (y0 * z1 - z0 * y1));

## lemma: kRayError: slope's own rounding, and that of its product with ray_error
{ @kRayError@ * (1 - 8 * e) - 1 >= 0 }
