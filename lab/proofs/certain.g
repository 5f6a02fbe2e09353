# Triangles that certainly occlude a ray, without the hit rule.
#
#   bounds       certain_occluders: where |e| > bound, from s + kCertainBound bound Z <= n <= to s -
#                kCertainBound bound Z, the rule finds a hit with 2^-18 X to spare at both ends of the range
#                certainly_beyond: where s >= kCertainBound bound and beyond s + kBeyondBound bound R <= n,
#                the rule's hit, if any, is beyond tfar; kOwnBeyondBound serves where the functions are
#                the rule's own and all |e| > bound have one sign
#   code         certain_occluders, certainly_beyond, rays_hitting, occluded_by_leaf
#                (cpu/single_ray/leaf-inl.h), prepare_range (cpu/single_ray/ray_stream-inl.h)
#   inputs       e: the error of a rounding; X = max(kSceneExtent, |org|) <= kCertainOrigin; Z <= 2.001 X the
#                largest |z|, R the range of z; n, s: sums of |e| z and |e|; c = kCertainBound; 1 <= |dir.z| < 2
#   by hand      the steps of docs/design/arithmetic.md: signs beyond the bound are those of the
#                exact functions; deviations from a mean add up to at most 2 R <= 4 Z; bound / s <= 1 / c;
#                s <= 3 M^2, so that M >= c r; e s covers what underflows
#
# step 0.5: kCertainBound kCertainDepth
# step 0.9: kBeyondBound kBeyondDepth kOwnBeyondBound

## lemma: n by three roundings of each term; s by two, from s and to s by one more, and the difference by
# one that keeps its sign
n = (1 + a) * (1 + b) * (1 + c) - 1;
{ rounded(a, b, c) -> |n| <= 0x3.001p-24 }

## lemma: kCertainDepth, from: the test, the mean, the sign of z, t, the ends; and 2^-18 of t
by_depth = (3.001 + 3.1) * e + 2 * @kRangeOfDepths@ + @kSizeOfDepths@
           + (2 * @kWeightRounding@ + @kMeanRounding@) * (1 + 8 * e) + @kTravel@ * (1 + 8 * e);
ends = 3 * 2.002 * e;
{ @kCertainDepth@ - (2.001 * by_depth + ends + 2 * 0x1p-18 + 0x1p-36) >= 0 }

## lemma: kCertainDepth, to, which is at most 4 X and little more; kBeyondDepth: the test, the mean, t, the end
by_depth = 3.001 * e + 2 * @kRangeOfDepths@ + @kSizeOfDepths@
           + (2 * @kWeightRounding@ + @kMeanRounding@) * (1 + 8 * e) + @kTravel@ * (1 + 8 * e);
ends = (4 + 0x1p-15) * (3.001 + 2.001) * e;
{ @kCertainDepth@ - (2.001 * by_depth + ends + 2 * 0x1p-18 + 0x1p-36) >= 0
  /\ @kBeyondDepth@ - (2.001 * by_depth + ends + 0x1p-36) >= 0 }

## lemma: kBeyondBound: the mean by 2 R, the rule's fast functions by 2 B R / S, B <= 1.27 bound
c = @kCertainBound@ * (1 - 16 * e);
{ 1.27 - (1 + 1 / 8) * (1 + 1 / 8) * (1 + 0x1p-10) >= 0
  /\ @kBeyondBound@ * (1 - 16 * e) - (2 + 2 * 1.27 * (1 + 16 * e) / (1 - (3 + 3 * 1.27) / c)) >= 0 }

## lemma: kOwnBeyondBound: the mean by 2 R, pairs by a sixteenth of the hit's error, 6 B R / S, B <= bound
c = @kCertainBound@ * (1 - 16 * e);
{ @kOwnBeyondBound@ * (1 - 16 * e) - (2 + 6 / 16 * (1 + 16 * e) / (1 - 3 / c)) >= 0 }

## lemma: kCertainBound: the mean by 4; the rule's fast functions and the sign of z by 2 B range / S each
c = @kCertainBound@ * (1 - 16 * e);
{ c - (4 + 2 * 8 * (1 + 16 * e) / (1 - 9 / c)) >= 0 }

## lemma: functions of slopes: six coordinates by 2 (8 e (x + Z) + 5 e x), at most an eighth of 3 M
r = @kFastProjectionError@;
c = @kCertainBound@ * (1 - 16 * e);
{ 1 / 8 - (6 * 2 * 8 * e / (3 * c * r) + 6 * 2 * 13 * e / 3) * (1 + 0x1p-10) >= 0
  /\ 2 - (1 + 1 / 8) * (1 + 1 / 8) * (1 + 0x1p-10) >= 0 }
