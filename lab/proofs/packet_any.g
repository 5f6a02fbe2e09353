# Any hits of a light packet: rays and blocks that certainly miss, by constants found once a leaf.
#
#   bounds       an edge function with most_c = c + kMissBound bound that is negative is less than
#                -bound as far as the rule goes; so is that of all of a block's rays where its maximum
#                with most_c is below -kBlockBound bound; 1/z with most_q is no less than the rule's, nor
#                is its maximum over a block's rectangle with kBlockGradient gradient more
#   code         store_edges, store_depth (cpu/packet/triangle_setup-inl.h); certainly_misses, blocks_reaching,
#                and EdgeRange, whose rectangles bound a block or several, and whose `lowest` is the same of
#                the negative function (cpu/packet/light_trace-inl.h)
#   inputs       a, b, c as stored (packet_edges.g): |a| + |b| <= 2 size z, |c| <= size^2 + 2 size R z;
#                bound >= kEdgeRounding size (reach + kShearRounding R z) + 2 kShearError R z reach;
#                depth_c <= q + R gradient; c0, c1, c2 as in packet_slant.g
#   operations   fl(c + fl(kMissBound bound)); a x + (b y + most_c); fl(half (lower + upper)), fl(half
#                (upper - lower)); two more products and sums; depth_c + (kMissGradient gradient + (1 + 2^-18)
#                error)
#   by hand      All is relative to u: S for size reach, T for size R z, so that size^2 <= S. Partial
#                sums are values of the function, at most S + 4 T, in the packet's square. The ray's
#                own roundings are in bound already (packet_edges.g). The rule hits nothing nearer than
#                nearest, which bounds both 1/z of the hit and that of its mean: no second order. If a
#                ray of a block hits, q in the packet's square is at most nearest, its error and 2 R
#                gradient on both sides, and so are all partial sums of the block's maximum. Without
#                fused operations a block's bounds may reach 55 where |X| <= 33 (twice ray_error): from
#                the hit to a corner 88 of 134 gradient; products round, too.
#
# step 0.85: kMissBound
# step 0.5: kBlockBound kMissGradient kBlockGradient
# step 0.25: kEdgeRounding
# step 0.57: kReciprocalRounding

## lemma: most_c: of c and of bound, and in two sums after that
# T's part of the bound is less than by kShearError too, which is not needed here.
once = 1 + 8 * e;
spare = @kMissBound@ * (1 - 8 * e) - 1;
{ spare * @kEdgeRounding@ * (1 - 16 * e) - e * once >= 0
  /\ spare * @kEdgeRounding@ * @kShearRounding@ * (1 - 16 * e) - 2 * e * once >= 0 }

## lemma: blocks: four sums (S + 4 T), most_c, products with |x| + half_x <= R, the middle and the half
once = 1 + 16 * e;
spare = @kMissBound@ * (1 - 16 * e) + @kBlockBound@ * down - 1;
s = 4 + 1;
t = 4 * 4 + 2 + 2 + 2 * 2;
{ spare * @kEdgeRounding@ * (1 - 16 * e) - s * e * once >= 0
  /\ spare * (@kEdgeRounding@ * @kShearRounding@ + 2 * @kShearError@) * (1 - 16 * e) - t * e * once >= 0 }

## lemma: most_q: by R gradient, by the error itself, and by q (kReciprocalRounding has more than 1/z)
{ @kMissGradient@ * (1 - 4 * e) - 33.5 * e >= 0 /\ 0x1p-18 - 6 * e >= 0
  /\ @kReciprocalRounding@ - 18.7 * e >= 0 }

## lemma: most_q for blocks: its own sum, four sums of up to nearest + 4 R gradient, the middle and the half,
# four products and ends of 55. By q: kReciprocalRounding has 18.7 u for a ray; four sums and that of kBlockGradient
# add 5 u, of the error, too (kLightErrorFactor).
once = 1 + 16 * e;
{ @kBlockGradient@ * (1 - 8 * e) - (5 * 4 * 33.5 + 2 * 33.5 + 2 * 55 + 4) * e * once >= 0
  /\ @kReciprocalRounding@ - (18.7 + 5.1) * e >= 0
  /\ 0x1p-18 - 11.1 * e >= 0 }
