# Lower bounds of the distances between points and triangles, and the error of the rule's.
#
#   bounds       if may_be_within() is false for some d2, the rule gives more than d2, and the triangle is
#                farther; the rule's distance is above that of the triangle by at most kRuleExcess R, and
#                below it by kRuleDefect R; so are the bounds of distance_bounds() at most;
#                a rounded point moves either by kPointRounding (|p| + 1)
#   code         may_be_within, distance_bounds (cpu/queries/tree_queries.cpp), triangle_distance2
#                (common/interop/closest_rule.h)
#   inputs       in units of R, the largest coordinate of vertices relative to the point
#   operations   roundings e by each operation; a sum of three products is off by 3 e of the lengths'
#                product, fused or not
#   used by      ClosestSearch (cpu/queries/tree_queries.cpp)
#   by hand      The rule's place is a mean of vertices that are off by e R each, and is clamped to
#                their box, in which the point of the triangle lies as well; components below kTiny =
#                2^-60 become 0. |v| <= sqrt(3) times its largest component, sqrt(3) < 1.7321. x = L / |w|
#                is at most the rule's distance plus g, and the triangle's plus g, and
#                (x - g)^2 >= x^2 / (1 + n) - g^2 / n for any n, here 2^-15. No product underflows that
#                decides: L <= |w|^2 as computed, and limits are at least kLeastNearestVertexErrorSquare.
#                distance_bounds: any place with weights from 0 on and any w will do. Its weights add up to 1
#                as the rule's do. What underflows in L is less than 2^-80, since |w| is taken for
#                2^-60 or more; kPointRounding leaves room for it.
#
# step 0.9999: kNearestVertexRounding
# step 0.05: kNearestVertexErrorSquare
# step 0.9: kRuleExcess
# step 0.8: kRuleDefect kPointRounding
# step 0.999999: kRivalRounding

# From the nearer end, so s <= 1/2; 1 - s is exact for s >= 1/2.
## lemma: a place on an edge, p + d s: 4.0625 e R
{ rounded(e1, e2, e3) /\ |p| <= 1 /\ |d| <= 2 /\ s in [0, 0.5]
  -> |p * e3 + d * s * ((1 + e1) * (1 + e2) * (1 + e3) - 1)| <= 0x4.1p-24 }

## lemma: a place x on an edge by s from either end, fused or not: 5.0625 e R
{ rounded(e1, e2, e3) /\ |x| <= 1 /\ |d| <= 2 /\ s in [0, 1]
  -> |x * e3 + d * s * ((1 + e1) * (1 + e2) - 1) * (1 + e3)| <= 0x5.1p-24 }

## lemma: the weights of a place inside add up to 1 within 2.125 e: 1 - S rounded, S = q + r rounded
{ rounded(e1, e2) /\ S in [0, 0x1.00001p0] -> |e2 * (1 - S) - e1 * S| <= 0x2.2p-24 }

## lemma: their mean: product and two sums, 3.125 e
{ rounded(e1, e2, e3) -> |(1 + e1) * (1 + e2) * (1 + e3) - 1| <= 0x3.2p-24 }

# So a component of a place is off by 4.0625 e for the rule's edge, by 5.0625 e for an edge of the bounds, by
# 3.125 (1 + 2.125 e) + 2.125 (1 + 2.125 e) < 5.3 e inside, by e more for vertices, and by 2^-60.

## lemma: the distance of such a place, the rule's too, is below that of the triangle by at most 11 e R + 2^-59
rule = 1.7321 * (5.3 + 1) * e;
{ 11 * e - rule >= 0 /\ 0x1p-59 - 1.7321 * 0x1p-60 >= 0 }

# Coordinates, three products, the length of w, the quotient and the product by kRuleExcess.
## lemma: the lower bound along any w is above the distance by at most kRuleExcess R
{ @kRuleExcess@ * (1 - 8 * e) - (1 + 3.125 + 1.5625 + 1 + 1 + 1) * 1.7321 * e >= 0 }

# The nearest vertex: coordinates, 2.125 e a component; sums of products, 3.125 e.
## lemma: g, and its square with that of 2^-59 twice
g = ((2.125 + 3.125) * 1.7321 + 11) * e;
{ 20.2 * e - g * (1 + 64 * e) >= 0 }

## lemma: the limit is large enough
n = 0x1p-15;
{ @kNearestVertexRounding@ * (1 - 24 * e) - (1 + n) >= 0
  /\ @kNearestVertexErrorSquare@ * (1 - 24 * e) * n - 2 * 20.2 * e * 20.2 * e * (1 + n) >= 0
  /\ @kLeastNearestVertexErrorSquare@ * (1 - 24 * e) * n - 2 * 0x1p-118 * (1 + n) >= 0 }

# How far the rule's distance is above that of the triangle. By hand, with R = 1, so that offsets are at most
# S = sqrt(3) long and edges 2 S. What is taken for 0 is less than kPointRounding 1, and the lemma leaves
# room for terms of second order.
#
# Edges. A foot is p.e / L from p, at most |p|. It is off by delta <= (10 + rho) e S: 4 e |p| of the dot
# product, and 5 + rho + 1 roundings of length, reciprocal and product. So the place is at most
# sqrt(D0^2 + delta^2) away, where D0 is the edge's distance, whether it is clamped or not.
#
# Inside. Let q be the triangle's closest point, d away, with weights y of the edge's end and x of r, and
# t = y + x r_along. The edge is the longest, so t L and x |f| are at most |q - p| <= |p| <= S. The computed
# `along` and `r_along` give a line, a = p + along e plus multiples of b = f - r_along e, both exact.
# 1. a + x b is off q by P along the edge: by 4 e |p| + 5 e x |f| of the dot products, by (t + x r_along) e L
#    of products, and by (5 + rho) y e L of the length and the reciprocal, which both weights share.
# 2. Let D^2 = d^2 + P^2, and w the distance of a + x b from the line's closest place, D' away:
#    D'^2 = D^2 - w^2. `height` is off b by g <= 3 e |f| + e |b|, and `foot` off a by 2 e t L + e |foot|,
#    where |foot| <= D + x |b|. If g <= |b| / 8, the computed place is off the closest one by Z + w / 7 with
#    Z = 8/7 (x g + 2 e t L + (1 + 3) e |foot|) + (3 + rho + 1) e x |b| + (8/7)^2 D g / |b|.
#    (Z + w / 7)^2 - w^2 <= 49/48 Z^2. So it is at most sqrt(D^2 + 49/48 Z^2) away.
# 3. The border is at most h / 2 from q, h being the height, and an edge's place sqrt(d^2 + h^2 / 4 + delta^2)
#    away. If g > |b| / 8, this suffices: |b| < 8 g, and h / 2 < 42 e.
# 4. Otherwise Z <= Q + C D / h for d <= 1/16, and Y, the least of h / 2 and sqrt(49/48) Z, has
#    Y^2 <= 49/48 Q^2 + sqrt(49/48) C D. Then sqrt(D^2 + Y^2 + delta^2) - d is largest for d = 0. For d > 1/16
#    it is less than 8 e, since squares are divided by 2 d.
# 5. The weight of the edge's end is rounded twice more, by e L each. If a weight is not above 0, then the
#    place is outside, or inside within e L of the border by the rounding of of_p. The way there from q
#    meets the border, no farther away than the place, and step 3's delta leads to an edge's place.
## lemma: the rule's excess; a sum, a root and a product are rounded, a part of d <= 1/16
S = 1.7321;
rho = 2 * @kRcpUlp@;
delta = (10 + rho) * e * S;
P = (4 + 5 + 2 + 5 + rho) * e * S;
Q = ((8 * (4 + 2 + 4) / 7 + 4 + rho) * S + (32 / 7 + 64 / 49) / 16) * e;
C = 64 / 49 * 3 * 2 * S * e;
border = 54 * e;
weights = (2 + 1) * 2 * S * e;
mean = 5.3 * S * e;
vertices = S * e;
root = (1.5625 + 3) * S / 16 * e;
{ border * border - (P * P + 1.0104 * C * P + 1.0209 * Q * Q + delta * delta) >= 0
  /\ @kRuleExcess@ * (1 - 1024 * e) - (border + weights + mean + vertices + root) >= 0 }

## lemma: the rule's defect, with the roundings of root, product and sums
{ @kRuleDefect@ * (1 - 64 * e) - 11 * e - (1.5625 + 4) * 1.7321 * e >= 0 }

## lemma: the point's rounding moves two distances
{ @kPointRounding@ * (1 - 8 * e) - 2 * 1.7321 * e >= 0 }

# Boxes: 5 roundings, a square and a product.
## lemma: the square is large enough
{ @kRivalRounding@ * (1 - 9 * e) - 1 >= 0 }
