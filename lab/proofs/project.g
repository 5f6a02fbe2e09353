# The compensated projection of a vertex, on one axis.
#
#   bounds       |x - exact| <= kProjection min(|x|, |exact|) + kProjectionOfRange r
#                               + kProjectionSnap, where
#                exact = a.x * d.z - d.x * a.z in real numbers, a = vertex - org without rounding,
#                r = the largest |component| of a as rounded
#   code         project, project_axis, snap_projected (common/interop/hit_rule.h)
#   inputs       |a.x|, |a.z| <= r, their errors ex and ez exact and at most half an ulp;
#                1 <= d.z < 2, |d.x| <= d.z
#   operations   major = difference_of_products(a.x, d.z, d.x, a.z)
#                minor = fl(fl(ex * d.z) - fl(d.x * ez))
#                x = snap_projected(fl(major + minor))
#   used by      fast_edges.g, boxes.g
#   by hand      r is 1: fl(y) = y (1 + e) with |e| <= 2^-24 holds at every scale. |q exact + p| is
#                at most |q| |exact| + |p|, and the snap is added to that.
#
# step 0.5: kProjection kProjectionOfRange kProjectedSnap kProjectedOnGrid
# step 0.25: kProjectionSnap
# kProjectionSnap: the snap is off by 2^-63 at most, half the bound

## identity: before the snap, x - exact = q exact + p
n = ex * dz - dx * ez;
left = ex * dz * (1 + e1);
right = dx * ez * (1 + e2);
major = (exact - n) * (1 + d);
minor = (left - right) * (1 + e3);
x = (major + minor) * (1 + s);
q = d + s + d * s;
p = (1 + s) * (n * (e3 - d) + (ex * dz * e1 - dx * ez * e2) * (1 + e3));
x - exact - (q * exact + p);

## identity: x - exact is also (q x + p) / (1 + q)
(x - exact) * (1 + q) - (q * x + x - exact - q * exact);

## lemma: q and p are within the bounds, for either form
n = ex * dz - dx * ez;
q = d + s + d * s;
p = (1 + s) * (n * (e3 - d) + (ex * dz * e1 - dx * ez * e2) * (1 + e3));
{ dz in [1, 2] /\ |dx| <= 2 /\ rounded(ex, ez) /\ |d| <= @kDifferenceOfProducts@
  /\ rounded(e1, e2, e3, s) -> |q| <= @kProjection@ /\ |q / (1 + q)| <= @kProjection@
  /\ |p| <= @kProjectionOfRange@ /\ |p / (1 + q)| <= @kProjectionOfRange@ }

## lemma: below kProjectedOnGrid, adding the constant is off by at most kProjectionSnap
sum = float<24,-149,ne>(x + @kProjectedSnap@);
{ x in [-@kProjectedOnGrid@, @kProjectedOnGrid@]
  -> |sum - (x + @kProjectedSnap@)| <= @kProjectionSnap@ /\ @FIX(sum, -63) }

## lemma: taking it away again is exact, and leaves a multiple of 2^-63
snapped = float<24,-149,ne>(sum - @kProjectedSnap@);
{ @FIX(sum, -63) /\ sum in [0x1p-39, 0x1p-38]
  -> snapped - (sum - @kProjectedSnap@) in [0, 0] /\ @FIX(snapped, -63) }

## lemma: beyond kProjectedOnGrid, x is a multiple of 2^-63
{ @FLT(x, 24) /\ |x| in [@kProjectedOnGrid@, 0x1p44] -> @FIX(x, -63) }
