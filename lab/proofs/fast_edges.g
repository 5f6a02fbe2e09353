# The edge functions of the fast path against those of the compensated projection.
#
#   bounds       |fast - compensated| <= (1 - kSpareOfBound) bound; compensated is the exact value
#                of the edge function of the points that project gives (or of the exact
#                projections: then one source of error less)
#   code         project_fast, fast_edges (common/interop/hit_rule.h); cpu/single_ray/leaf-inl.h
#   inputs       |d| < 2, |d.x| <= d.z, |d.y| <= d.z, d.z >= 1
#   operations   x = fl(fl(a.x * d.z) - fl(d.x * a.z)), y likewise; m = sum of |x| + |y| over the
#                vertices; Z = largest |a.z|; r = fl(fl(kFastProjectionError * fl((m + m) + Z))
#                + kFastProjectionFloor); bound = fl(r * fl(m + fl(r + r)));
#                fast = fl(fl(b.x * c.y) - fl(b.y * c.x))
#   used by      may_be_inside, surely_inside; depth.g
#   by hand      In real numbers fl(y) = y (1 + e), |e| <= 2^-24, holds at every scale; where a
#                lemma bounds something "for R = 1", both sides are divided by R, the largest
#                |component| of the vertices' a. An underflow costs 2^-126 at most, whether or not a
#                device flushes; it is among the last lemma's terms. X <= m is the largest |x| or
#                |y|. All operations of bound are on numbers that are not negative, so that each
#                result grows with its operands.
#
# step 16/17: kFastProjectionError
# step 0.25: kFastProjectionFloor
# step 2: kProjection kSpareOfBound
# kFastProjectionFloor: a half would do, for products that underflow: last lemma

## identity: x - compensated = p - x k, where compensated = exact (1 + q) + g as project.g has it
x0 = ax * dz * (1 + e2);
x1 = dx * az * (1 + e4);
x = (x0 - x1) / (1 + f);
exact = ax * (1 + e1) * dz - dx * (az * (1 + e3));
compensated = exact * (1 + q) + g;
h = ax * dz * (e2 - e1) - dx * az * (e4 - e3);
x0 - x1 - h - exact;
X - ((X * (1 + f) - H) * (1 + q) + g) - ((1 + q) * H - g - X * (f + q + f * q));

## lemma: for R = 1, |k| <= 4 e (1 + 2^-10) and |p| <= 8 e (1 + 2^-17), the snap apart
h = ax * dz * (e2 - e1) - dx * az * (e4 - e3);
{ dz in [1, 2] /\ |dx| <= 2 /\ |ax| <= 1 /\ |az| <= 1 /\ |q| <= @kProjection@
  /\ |g| <= @kProjectionOfRange@ /\ rounded(f, e1, e2, e3, e4) -> |f + q + f * q| <= 0x1.004p-22
  /\ |(1 + q) * h - g| <= 0x1.0001p-21 }

## lemma: R <= (1 + 2^-20) (X + Z), from R (1 - e) <= (1 + e) X + 8 e R + (1 + e) Z
{ up / (1 - 9 * e) <= 0x1.00001p0 }

## lemma: so delta <= 8 e (1 + 2^-9) Z + 12 e (1 + 2^-9) m + kProjectionSnap, of each x and y
{ 0x1.00001p0 * 0x1.0001p-21 <= 0x1.008p-21
  /\ 0x1.00001p0 * 0x1.0001p-21 + 0x1.004p-22 <= 0x1.818p-21 }

## identity: two points displaced by delta: |x y' - y x'| changes by at most delta m + 2 delta^2
(bx + d1) * (cy + d2) - (by + d3) * (cx + d4) - (bx * cy - by * cx)
   - (bx * d2 + d1 * cy - by * d4 - d3 * cx + (d1 * d2 - d3 * d4));

## lemma: the three roundings of a function: a product times at most 2 e (1 + 2^-20)
{ rounded(e1, e3) -> |(1 + e1) * (1 + e3) - 1| <= 0x1.00001p-23 }

## identity: the products add up to at most (m / 2)^2: b's |x| + |y| times c's, which add up to m
(b + c) * (b + c) - 4 * b * c - (b - c) * (b - c);

## lemma: m, then r, then bound as computed: at least 1 - 2^-20 times their values in real numbers
{ down^7 * down^7 - (1 - 0x1p-20) >= 0 }

## lemma: (1 - spare) (1 - 2^-20) r (m + 2 r) has no coefficient below that of the error's bound
c = @kFastProjectionError@;
f = @kFastProjectionFloor@;
s = @kProjectionSnap@;
a = 0x1.008p-21;    # of Z in delta
b = 0x1.818p-21;    # of m in delta
left = (1 - @kSpareOfBound@) * (1 - 0x1p-20);
{ left * (2 * c + 8 * c * c) - (b + 2 * b * b + 0x1.00001p-25) >= 0          # m m
  /\ left * (c + 8 * c * c) - (a + 4 * a * b) >= 0                           # m Z
  /\ left * (2 * c * c) - 2 * a * a >= 0                                     # Z Z
  /\ left * (f + 8 * c * f) - (s + 4 * b * s) >= 0                           # m
  /\ left * (4 * c * f) - 4 * a * s >= 0                                     # Z
  /\ left * (2 * f * f) - (2 * s * s + 0x1p-124) >= 0 }                      # 1

## identity: these are the coefficients of both sides
(c * (2 * m + Z) + f) * (m + 2 * (c * (2 * m + Z) + f))
  - ((2 * c + 8 * c * c) * m * m + (c + 8 * c * c) * m * Z + 2 * c * c * Z * Z
     + (f + 8 * c * f) * m + 4 * c * f * Z + 2 * f * f);
(a * Z + b * m + s) * m + 2 * (a * Z + b * m + s) * (a * Z + b * m + s)
  - ((b + 2 * b * b) * m * m + (a + 4 * a * b) * m * Z + 2 * a * a * Z * Z
     + (s + 4 * b * s) * m + 4 * a * s * Z + 2 * s * s);

# A function beyond bound has a product of at least f^2. If a quarter of its ulp exceeds whatever
# underflows (2^-126), the difference is that product on every device.
## lemma: products that underflow do not matter to a function beyond bound
f = @kFastProjectionFloor@;
{ f * f * 0x1p-23 / 4 >= 0x1p-126 }
