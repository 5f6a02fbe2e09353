# The volume of triangle and origin, whose sign is that of a hit's edge functions.
#
#   bounds       let e'_k >= 0 or <= 0 be the edge functions of a hit, z'_k the packet's z of the
#                displaced vertices, tau = sum(e'_k z'_k) / sum(e'_k): |det^ - tau sum(e'_k)| +
#                what is needed for tau to be as positive as the rule sees it <= det_error =
#                L (L (kVolumeRounding z + kVolumeExtentError s_z extent) + kVolumeError error z). Where |det^| <= det_error and all vertices are well in
#                front of the origin, |e'_k| <= kEitherSign det_error / z_least.
#   code         find_volume, orient (cpu/packet/triangle_setup-inl.h)
#   inputs       L = hit_reach >= size, |l| + error for rays in the rectangle; error and z as in
#                packet_vertices.g; D the direction at z = 1, r the rule's axis
#   operations   edges, cross product, its product with a vertex: seven factors, with fused operations
#                (Kahan's difference of products is 2 u of itself off) or without
#   used by      packet_slant.g
#   by hand      The displaced vertices' mean under the e'_k is tau D, and the rule displaces nothing
#                along its axis, so that tau D_r is the mean of their exact coordinates there. The
#                rule's z > 0 is that of the rounded ones: tau > -u Z,
#                Z <= z + 2 s_z extent, because 1 / D_r <= s_z. And |e'_k| <= L^2, |det's terms| <= 12
#                L^2 z, |e' - e^| <= error (2 |l| + error). The first vertex is no farther than
#                D_r tau + 3 extent, so s_z distance <= kappa z + 3 s_z extent with kappa = s_z D_r,
#                for which 2^18 is allowed.
#
# step 0.9: kVolumeError kEitherSign
# step 0.5: kVolumeRounding kVolumeExtentError kDepthError
# step 0.75: kExtentError

## identity: edge functions that are off times z, and z that are off times edge functions
(e + d) * (z + c) - e * z - (d * (z + c) + e * c);

## lemma: kVolumeError: three times error (2 |l| + error) <= 2 error L
{ error in [0, 1] -> 2 * (l + error) - (2 * l + error) >= 0 }
2 * (l + error) - (2 * l + error) -> error;

## lemma: of L error z
{ @kVolumeError@ * (1 - 16 * e) - 3 * 2 >= 0 }

## lemma: seven roundings
c = (1 + a) * (1 + b) * (1 + p) * (1 + q) * (1 + r) * (1 + s) * (1 + t) - 1;
{ rounded(a, b, p, q, r, s, t) -> |c| <= 0x7.001p-24 }

## lemma: of L^2 z, and of L^2 s_z extent; the error of z
least = (1 + 0x1p-16) * e;                        # the rule's least depth
far = @kVertexOfRange@;
z = 12 * 0x7.001p-24 + 3 * (@kVertexOfPlace@ + least + far * 0x1p18);
extent = 3 * (@kVertexOfExtent@ + 2 * least + 3 * far);
{ @kVolumeRounding@ * (1 - 16 * e) - z >= 0 /\ @kVolumeExtentError@ * (1 - 16 * e) - extent >= 0
  /\ @kDepthError@ * (1 - 16 * e) - (@kVertexOfPlace@ + least + far * 0x1p18) >= 0
  /\ @kExtentError@ * (1 - 16 * e) - (@kVertexOfExtent@ + 2 * least + 3 * far) >= 0 }

## lemma: kEitherSign, where z_least > 2^-10 z_size + 16 leaf_error; z has less than 1/34 of that
nearest = 1 - @kVertexOfPlace@ * 0x1p10 - 1 / (16 * 34);
{ @kEitherSign@ * nearest * (1 - 16 * e) - 2 >= 0 }
