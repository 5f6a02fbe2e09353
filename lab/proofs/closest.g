# Lower bounds of the distances between points and triangles.
#
#   bounds       if may_be_within() is false for some d2, the rule gives more than d2
#   code         may_be_within (cpu/queries/nearest_vertex-inl.h), triangle_distance2
#                (common/interop/closest_rule.h)
#   constants    kNearestVertexRounding, kNearestVertexErrorSquare, kLeastNearestVertexErrorSquare,
#                kRuleError, kRivalRounding
#   inputs       in units of R, the largest coordinate of vertices relative to the point
#   operations   roundings e by each operation; a sum of three products is off by 3 e of the lengths'
#                product, fused or not
#   used by      ClosestSearch (cpu/queries/closest_search-inl.h)
#   by hand      The rule's place is a mean of vertices that are off by e R each, and is clamped to
#                their box, in which the point of the triangle lies as well; components below kTiny =
#                2^-60 become 0. |v| <= sqrt(3) times its largest component, sqrt(3) < 1.7321. x = L / |w|
#                is at most the rule's distance plus g, and
#                (x - g)^2 >= x^2 / (1 + n) - g^2 / n for any n, here 2^-15. No product underflows that
#                decides: L <= |w|^2 as computed, and limits are at least kLeastNearestVertexErrorSquare.
#
# step: kNearestVertexRounding 0.9999
# step: kNearestVertexErrorSquare 0.1
# step: kRuleError 0.5
# step: kRivalRounding 0.999999

## lemma: a place on an edge, p + d s with a weight that is off by w: 10 e R
{ |e1| <= @kRounding@ /\ |e2| <= @kRounding@ /\ |e3| <= @kRounding@ /\ |w| <= @kRounding@
  /\ |p| <= 1 /\ |d| <= 2 /\ s in [0, 1]
  -> |p * e3 + d * s * ((1 + e1) * (1 + e2) * (1 + e3) - 1) + d * w * ((1 + e1) * (1 + e2) * (1 + e3))|
     <= 0xap-24 }

## lemma: the weights of a place inside add up to 1 within 2.125 e: 1 - S rounded, S = q + r rounded
{ |e1| <= @kRounding@ /\ |e2| <= @kRounding@ /\ S in [0, 0x1.00001p0]
  -> |e2 * (1 - S) - e1 * S| <= 0x2.2p-24 }

## lemma: their mean: product and two sums, 3.125 e
{ |e1| <= @kRounding@ /\ |e2| <= @kRounding@ /\ |e3| <= @kRounding@
  -> |(1 + e1) * (1 + e2) * (1 + e3) - 1| <= 0x3.2p-24 }

# So a component of the rule's place is off by 10 e for an edge, by 3.125 (1 + 2.125 e) + 2.125 (1 + 2.125 e)
# < 5.3 e inside, by e more for vertices, and by 2^-60.

## lemma: the rule's distance is below that of the triangle by at most 19.1 e R + 2^-59
rule = 1.7321 * (10 + 1) * @kRounding@;
{ 19.1 * @kRounding@ - rule >= 0 /\ 0x1p-59 - 1.7321 * 0x1p-60 >= 0 }

# The nearest vertex: coordinates, 2.125 e a component; sums of products, 3.125 e.
## lemma: g, and its square with that of 2^-59 twice
e = @kRounding@;
g = ((2.125 + 3.125) * 1.7321 + 19.1) * e;
{ 28.3 * e - g * (1 + 64 * e) >= 0 }

## lemma: the limit is large enough
e = @kRounding@;
n = 0x1p-15;
{ @kNearestVertexRounding@ * (1 - 24 * e) - (1 + n) >= 0
  /\ @kNearestVertexErrorSquare@ * (1 - 24 * e) * n - 2 * 28.3 * e * 28.3 * e * (1 + n) >= 0
  /\ @kLeastNearestVertexErrorSquare@ * (1 - 24 * e) * n - 2 * 0x1p-118 * (1 + n) >= 0 }

# Rivals: R is at most |p| + kSceneExtent. kRuleError of 1.75 times that is for distances that are too
# small, and the same again for those that are too large, which are measured ("Distances"), and for the
# rounding of the point.
## lemma: the error of distances that are too small, also where it is rounded
e = @kRounding@;
{ @kRuleError@ * 1.75 * (1 - 8 * e) - 19.1 * e * (1 + 64 * e) - 0x1p-59 >= 0 }

# A root, a sum and its square, and the product: 6 roundings.
## lemma: the square is large enough
e = @kRounding@;
{ @kRivalRounding@ * (1 - 8 * e) - 1 >= 0 }
