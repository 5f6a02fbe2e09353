# How far secondary rays start off the surface.
#
#   bounds       the point of off_surface lies on its side of the plane through the triangle, seen
#                along the normal that it is moved along, if the exact edge functions gave the
#                weights, and the vertices are at most 8 times as far away as the hit and
#                at most 8 times its distance apart along the ray
#   code         surface_at, off_surface, unit (common/interop/surface.h)
#   inputs       size >= 2^-20 (2^-40 of the scene's extent; nearer, the grid is too coarse);
#                normal: the rounded one; its direction is taken as exact
#   operations   travel = fl(t * d); point = fl(org + travel); size = sum of |components| of both;
#                p = snap_point(fl(point + fl(normal * fl(kSurfaceOffset * size))))
#   by hand      Errors in units of size, as sums of |components|: the two roundings of the point,
#                the one of the moved point, the snap (2^-40 for each axis). z is off by
#                kRangeOfDepths of the range and kSizeOfDepths of the farthest vertex, at most
#                8 |travel| each, and t by kTravel; all move the point along the ray. The projection
#                is off by kProjection of the vertex's distance from the ray, at most 2 * 8 |travel|
#                on each of two axes.
#
# step 0.5: kSurfaceOffset
# step 2: kRangeOfDepths kSizeOfDepths

## lemma: unit() gives a length of at least 1 - 2^-20, and its square at most 1 + 2^-19
rho = @kRsqrtUlp@ * 0x1p-23;
{ down^2 * (1 - rho) * (1 - rho) / up^3 - (1 - 0x1p-20) * (1 - 0x1p-20) >= 0
  /\ up^2 * (1 + rho) * (1 + rho) / down^3 <= 0x1.00002p0 }

## lemma: the offset exceeds all errors
size = up^3;        # |components| over the computed size, at most
roundings = 2 * e * size + 2 * e * (size + 2 * @kSurfaceOffset@);
snap = 3 * 0x1p-40 / 0x1p-20;
depth = (8 * (@kRangeOfDepths@ + @kSizeOfDepths@) + @kTravel@) * size * (1 + 0x1p-19);
projection = 1.4143 * (2 * 8 * @kProjection@ + 16 * @kProjectionOfRange@) * size * up;
{ @kSurfaceOffset@ * (down^2 * (1 - 0x1p-20))
  - (roundings + snap + depth + projection) >= 0 }
