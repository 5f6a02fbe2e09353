# Rays without a packet that are sorted out before the rule.
#
#   bounds       boxes of node_lanes within theirs (boxes.g says what for); project_by_slopes: vertices
#                within those of project_fast; may_be_ahead: sum(E z) <= sum(|e| z) + Z (kBehindError S + 4 bound); depthless_bound
#                above edge_bound for |z| up to most_depth
#   code         project_by_slopes, may_be_ahead (cpu/single_ray/leaf-inl.h), depthless_bound
#                (cpu/single_ray/ray_stream-inl.h), met_slots, rays_meeting (cpu/single_ray/node_lanes-inl.h)
#   by hand      depthless_bound: (m + 2 r) r with r = 2 c m + q; both bounds are sums and products of
#                numbers that are not negative, so that their roundings multiply.
#                may_be_ahead: a hit has sum(E z) > 0 (depth.g); where weights are dropped, by 2^-58.
#
# step 0.5: kBehindError kUnfusedDilation kFusedDilation kLeastDilations
# step 0.9999998: kDepthRounding
# step 0.99999: kDepthlessBound
# step 0.9999998: kFusedSlabRounding
# step 2: kRcpUlp

## lemma: node_lanes: the dilation less the roundings of k and of products by o is that of hits_box: o + D
once = 1 + 4 * e;
stored = down^4;      # product, sum, product with |r|, k
rounded_sum = @kDilationOfOrigin@ * up^3 + e;      # of o + D, times |o|
{ @kFusedDilation@ * stored - e * once * (1 + @kFusedDilation@) - rounded_sum >= 0
  /\ @kUnfusedDilation@ * stored - 3 * e * once * (1 + @kUnfusedDilation@) - rounded_sum >= 0
  /\ @kLeastDilations@ * (stored - 3 * e * once) - up^3 >= 0 }

## lemma: node_lanes: so it covers the 2^-42 E of boxes.g, and 2^-41 E where a component of dir is 0
{ @kDilationOfExtent@ * @kLeastDilations@ * down^4 - 0x3p-42 - 0x1p-43 >= 0 }

## lemma: node_lanes: a refined hit is kIntervalRounding before its entry in hits_box, and not beyond last_depth
{ (1 - 0x3.01p-24) * (1 - @kIntervalRounding@) * down^2 * @kDepthRounding@ - up^3 >= 0 }

## lemma: node_lanes: 1/d, a product, the difference; r_far; entries are at most 3.01 e late
{ @kFusedSlabRounding@ * down^3 - up^2 >= 0 /\ @kSlabRounding@ * down^4 - up^3 >= 0
  /\ 1 + 0x3.01p-24 - up^3 >= 0 }

## lemma: project_by_slopes: both coordinates, reciprocal, slope and its product; the difference, `project`
slope = (1 + rcp_error) * up^2 - 1;
{ 8 * e - (2 * e + slope + @kProjectionOfRange@) * (1 + 2 * e) >= 0
  /\ 5 * e - (e + @kProjection@) * (1 + 2 * e) >= 0 }

## lemma: may_be_ahead: N by three roundings of each term; 4 bound of 3
{ @kBehindError@ * (1 - 8 * e) - (3.001 * e + 0x1p-58) >= 0 /\ 4 * (1 - 8 * e) - 3 * (1 + 4 * e) >= 0 }

## lemma: depthless_bound: by m m, q m and q q; r and edge_bound round 8 times, this bound 8 times
c = @kFastProjectionError@;
k = @kDepthlessBound@;
{ 2 * c * k * down^8 - 2 * c * (1 + 4 * c) * up^8 >= 0
  /\ k * down^8 - (1 + 8 * c) * up^8 >= 0 /\ 2 * k * down^8 - 2 * up^8 >= 0 }
