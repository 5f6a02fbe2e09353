# Crossings of a half-line that floats decide.
#
#   bounds       an edge function is within 3/4 bound of the exact one, and the height, times twice
#                the area, within `error` of the exact one: both for the coordinates before they
#                were brought into scene space
#   code         float_crossing (common/interop/winding_rule.h)
#   inputs       coordinates of at most 2^21, each within 2^-40 of that before scene space
#                (snap_coordinate); so differences are within D = 2^-39 of theirs
#   operations   r = fl(v - p) for each vertex; u = fl(fl(b.x * c.y) - fl(b.y * c.x)), v and w
#                likewise; m = fl(M + c) with M = fl(sum of |x| + |y|), c = kCoordinateError;
#                bound = fl(m * fl(fl(kWindingEdgeError * m) + c));
#                height = fl(fl(fl(u z) + fl(v z)) + fl(w z)); sum = fl(|u| + |v| + |w|);
#                error = fl(fl(fl(fl(3 bound) + fl(kWindingHeightError sum)) * fl(Z + c)) + fl(c sum))
#                with Z the largest |z|
#   used by      WindingQuery, shaders/queries/winding.comp
#   by hand      A triangle is beside or above the point if all r on an axis are beyond c: then the
#                exact differences have that sign (first lemma). Two points that are displaced
#                change a product of their coordinates by what fast_edges.g says. All operations of
#                bound and error are on numbers that are not negative, and there are fewer than 16
#                of them one after the other. Nothing underflows: products of two coordinates are
#                multiples of 2^-80, and of three of 2^-120.
#
# step 0.25: kCoordinateError
# step 0.45: kWindingEdgeError kWindingHeightError

## lemma: a difference beyond c has the sign of the exact one: c (1 - 2 e) > D
{ @kCoordinateError@ * (1 - 2 * e) - 0x1p-39 >= 0 }

## lemma: r is within e (1 + 2^-20) |r| + D of the exact difference, since r = (exact + d) (1 + f)
{ rounded(f) -> |1 / (1 + f) - 1| <= 0x1.00001p-24 }

## lemma: three roundings of an edge function, by the sum of its products: 2 e (1 + 2^-20)
{ rounded(e1, e3) -> |(1 + e1) * (1 + e3) - 1| <= 0x1.00001p-23 }

## lemma: two displaced factors, by the sum of their products: 2 e (1 + 2^-19)
{ |f1| <= 0x1.00001p-24 /\ |f2| <= 0x1.00001p-24 -> |(1 + f1) * (1 + f2) - 1| <= 0x1.00002p-23 }

# The products of an edge function add up to at most (m / 2)^2 (fast_edges.g), so it is within
#     e (1 + 2^-18) M^2 + D (1 + 2^-20) M + 2 D^2
# of the exact one. bound is at least (1 - 2^-20) (M + c) (k (M + c) + c), which is
#     (1 - 2^-20) (k M^2 + (2 k c + c) M + (k c + c) c).
## lemma: no coefficient of 3/4 bound is below that of the error
k = @kWindingEdgeError@;
c = @kCoordinateError@;
left = 0.75 * (1 - 0x1p-20);
{ left * k - 0x1.00004p-24 >= 0
  /\ left * (2 * k * c + c) - 0x1p-39 * (1 + 0x1p-20) >= 0
  /\ left * (k * c + c) * c - 2 * 0x1p-39 * 0x1p-39 >= 0 }

## identity: these are the coefficients of bound
(M + c) * (k * (M + c) + c) - (k * M * M + (2 * k * c + c) * M + (k * c + c) * c);

## lemma: roundings of the height, by the sum of its products: 3 e (1 + 2^-20)
{ rounded(e1, e2, e3) -> |(1 + e1) * (1 + e2) * (1 + e3) - 1| <= 0x1.80001p-23 }

# The exact height is within 3 B (1 + 2^-20) (Z + D) + sum (e (1 + 2^-20) Z + D) of that of u, v, w
# and z as computed, where B is 3/4 bound; with the roundings before,
#     9/4 bound (1 + 2^-20) (Z + D) + sum (4 e (1 + 2^-19) Z + D).
# error is at least (1 - 2^-20) ((3 bound + h sum) (Z + c) + c sum).
## lemma: no coefficient of error is below that of the height's error
h = @kWindingHeightError@;
c = @kCoordinateError@;
low = 1 - 0x1p-20;
{ low * 3 - 2.25 * (1 + 0x1p-20) >= 0                        # bound Z
  /\ low * 3 * c - 2.25 * (1 + 0x1p-20) * 0x1p-39 >= 0       # bound
  /\ low * h - 0x1.00002p-22 >= 0                            # sum Z
  /\ low * (h * c + c) - 0x1p-39 >= 0 }                      # sum
