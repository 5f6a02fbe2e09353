# Planes that separate triangles, and sides of planes, in doubles.
#
#   bounds       a dot product of any vector and a difference of floats is off by less than
#                kPlaneRounding of the sum of its products' computed sizes; the difference of two of
#                them by less than 4 kPlaneRounding of the sizes with the largest differences; a
#                triple product of differences or of two and a vector by kSideRounding
#   code         surely_above, are_separate, meet_in_edge (cpu/queries/crossing_pairs.cpp);
#                certain_side (common/scene/triangle_crossing.cpp)
#   inputs       any floats: products of six differences neither overflow nor underflow in doubles
#   operations   differences, products and sums in any order, fused or not; d is 2^-53
#   by hand      Roundings of a term: its differences, its products and two sums, in a dot product
#                four, in a triple product at most eight. Each is a factor between 1 - d and 1 + d,
#                and so is each of the computed sizes and of their product with the constant.
#
# step 0.45: kPlaneRounding kSideRounding

## lemma: dot products
d = 0x1p-53;
{ @kPlaneRounding@ * ((1 - d) * (1 - d) * (1 - d) * (1 - d) * (1 - d) * (1 - d))
  - ((1 + d) * (1 + d) * (1 + d) * (1 + d) - 1) >= 0 }

## lemma: differences of two dot products, each at most its sizes, and the rounding of both
d = 0x1p-53;
term = (1 + d) * (1 + d) * (1 + d) * (1 + d);
{ 4 * @kPlaneRounding@ * ((1 - d) * (1 - d) * (1 - d) * (1 - d) * (1 - d) * (1 - d))
  - (2 * (term - 1) + 2 * d * term) >= 0 }

## lemma: triple products
d = 0x1p-53;
{ @kSideRounding@ * ((1 - d) * (1 - d) * (1 - d) * (1 - d) * (1 - d) * (1 - d) * (1 - d) * (1 - d)
    * (1 - d) * (1 - d))
  - ((1 + d) * (1 + d) * (1 + d) * (1 + d) * (1 + d) * (1 + d) * (1 + d) * (1 + d) - 1) >= 0 }
