# a * b - c * d with the errors of both products.
#
#   bounds       |result - (a b - c d)| <= kDifferenceOfProducts |a b - c d|: 2^-23 to first order
#   code         difference_of_products (common/interop/hit_rule.h)
#   inputs       any floats whose products are far from under- and overflow (grids.cpp)
#   operations   left = fl(a b), right = fl(c d); their errors el, er, exact (small_floats.cpp);
#                major = fl(left - right); minor = fl(el - er); fl(major + minor)
#   used by      project.g, depth.g
#   by hand      left >= |right| and left in [1, 2) by symmetry and a power of two. The cases:
#                far (right <= left / 2, of either sign), near in one binade (both in [1, 2]),
#                near in two (left in [2, 4], scaled by 2; right in [1, 2]). Near, major is exact
#                (Sterbenz). In two binades with left = 2, either |el - er| <= 2^-23 (exact),
#                or el > 2^-24, because a product that rounds to 2 from below is off by 2^-24 at
#                most; then the result is at least 2^-23 + 2^-23.
#                small_floats.cpp searches the result's error in small formats, where it is 2 u at most.
#
# step 0.5: kDifferenceOfProducts

## lemma: far
major = float<24,-1000,ne>(left - right);
minor = float<24,-1000,ne>(el - er);
result = float<24,-1000,ne>(major + minor);
exact = left - right + (el - er);
{ left in [1, 2] /\ right in [-2, 1] /\ left - right in [0.5, 4] /\ rounded(el, er)
  -> |result -/ exact| <= @kDifferenceOfProducts@ }

## lemma: near, in one binade: minor is exact, only the sum rounds
minor = float<24,-1000,ne>(el - er);
{ @FIX(el, -47) /\ @FIX(er, -47) /\ rounded(el, er)
  -> minor - (el - er) in [0, 0] /\ e <= @kDifferenceOfProducts@ }

## lemma: near, in two binades, left > 2
minor = float<24,-1000,ne>(el - er);
result = float<24,-1000,ne>(left - right + minor);
exact = left - right + (el - er);
{ left in [0x1.000002p1, 4] /\ right in [1, 0x1.fffffep0] /\ |el| <= 0x1p-23 /\ rounded(er)
  -> |result -/ exact| <= @kDifferenceOfProducts@ }

## lemma: near, in two binades, left = 2 and |el - er| <= 2^-23
minor = float<24,-1000,ne>(el - er);
result = float<24,-1000,ne>(2 - right + minor);
exact = 2 - right + (el - er);
{ right in [1, 0x1.fffffep0] /\ @FIX(el, -47) /\ @FIX(er, -47) /\ |el - er| <= 0x1p-23
  /\ |exact| in [0x1p-80, 4] -> |result -/ exact| <= @kDifferenceOfProducts@ }

## lemma: near, in two binades, left = 2 and el > 2^-24
minor = float<24,-1000,ne>(el - er);
result = float<24,-1000,ne>(2 - right + minor);
exact = 2 - right + (el - er);
{ right in [1, 0x1.fffffep0] /\ el in [0x1p-24, 0x1p-23] /\ rounded(er) /\ exact >= 0x1p-23
  -> |result -/ exact| <= @kDifferenceOfProducts@ }
