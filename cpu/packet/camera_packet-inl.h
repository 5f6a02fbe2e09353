// Closest candidates of a camera packet's rays: blocks of rays; a triangle at a block's rays; a
// leaf against blocks; and the tree, where the active rays at a node are a set of blocks.
#include <array>
#include <bit>
#include <utility>

#include "cpu/packet/camera_candidates-inl.h"
#include "cpu/packet/triangle_setup-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

// ---- Blocks

/// A word with the first column of each of its four rows of blocks.
inline constexpr std::uint64_t kEachRow = 0x0001000100010001;

/// The blocks of some of a word's four rows, which are bits.
inline constexpr auto kWordRows = [] {
    std::array<std::uint64_t, 16> blocks{};
    for (std::uint64_t rows = 0; rows < 16; ++rows) {
        for (std::uint32_t row = 0; row < 4; ++row)
            blocks[rows] |= (rows >> row & 1) * 0xFFFF << row * kGridSide;
    }
    return blocks;
}();

HWY_INLINE bool blocks_of_grid(std::uint32_t columns, std::uint32_t rows, const BlockSet& among,
                               BlockSet& out) {
    const std::uint64_t of_columns = columns * kEachRow;
    std::uint64_t any = 0;
    for (std::uint32_t w = 0; w < kGridWords; ++w) {
        out.words[w] = among.words[w] & of_columns & kWordRows[rows >> 4 * w & 15];
        any |= out.words[w];
    }
    return any != 0;
}

/// Updates block_q of four blocks at once from their rays.
HWY_INLINE void find_four_depths(CameraPacket& packet, const std::uint32_t blocks[4]) {
    FloatVec least[4];
    for (int i = 0; i < 4; ++i) {
        const float* const q = packet.q_lower + blocks[i] * kBlockRays;
        least[i] = load(q);
        for (std::size_t l = kLanes; l < kBlockRays; l += kLanes)
            least[i] = min(least[i], load(q + l));
    }
    alignas(16) float q[4];
    reduce_four(
        least, [](auto a, auto b) HWY_ATTR { return hn::Min(a, b); }, q);
    for (int i = 0; i < 4; ++i) packet.block_q[blocks[i]] = q[i];
}

/// The rays of a block within `pixels` that a hit at 1/z <= q may concern, as bits.
HWY_INLINE std::uint32_t rays_beyond(const CameraPacket& packet, float q, std::uint32_t block,
                                     const PixelRectangle& pixels) {
    const int x = static_cast<int>(block % kGridSide * kBlockSide);
    const int y = static_cast<int>(block / kGridSide * kBlockSide);
    const auto in_block = [](int pixel) {
        return static_cast<std::uint32_t>(std::clamp(pixel, 0, int{kBlockSide} - 1));
    };
    const float* const q_lower = packet.q_lower + block * kBlockRays;
    const std::uint32_t beyond =
        bits_of_sixteen([&](std::size_t l) HWY_ATTR { return splat(q) >= load(q_lower + l); });
    // Columns of rays are four bits each, one after the other; rows every fourth bit.
    const std::uint32_t columns = 0xFFFFu << kBlockSide * in_block(pixels.first_x - x) &
                                  0xFFFFu >> kBlockSide * (3 - in_block(pixels.last_x - x));
    const std::uint32_t rows =
        0xFu << in_block(pixels.first_y - y) & 0xFu >> (3 - in_block(pixels.last_y - y));
    return beyond & columns & rows * 0x1111u;
}

// ---- Items

/// A set-up triangle in registers, with the error of its 1/z.
struct GridPlanes : Planes {
    HWY_INLINE GridPlanes(const CameraTriangles& triangles, std::uint32_t i)
        : Planes(triangles, i), error(splat(triangles.error[i])) {}

    FloatVec error;
};

/// The least edge function of a triangle and 1/z at as many rays of a block as there are lanes.
struct ItemValues {
    FloatVec least_edge, depth;
};

/// Finds these values for a triangle that meets many blocks. Edge functions and 1/z are found in
/// the middle of each block, four rows of blocks at a time. A ray adds to them by its place in the
/// block. The bounds of TriangleSetup cover the rounding of these sums (lab/proofs/packet_edges.g,
/// packet_slant.g).
class RowPlanes {
public:
    HWY_INLINE RowPlanes(const CameraPacket& packet, const GridPlanes& p, std::uint32_t columns)
        : packet_(packet), planes_(p), columns_(columns * kEachRow) {
        for (std::size_t i = 0; i < kBlockRays / kLanes; ++i) {
            const FloatVec x = load(kGrid.offset_x + i * kLanes);
            const FloatVec y = load(kGrid.offset_y + i * kLanes);
            for (int k = 0; k < 4; ++k) more_[k][i] = mul_add(p.a[k], x, p.b[k] * y);
        }
        for (std::size_t i = 0; i < kVectors; ++i) {
            const FloatVec x = load(kGrid.middle + i * kLanes);
            for (int k = 0; k < 4; ++k) at_column_[k][i] = mul_add(p.a[k], x, p.c[k]);
        }
        const FloatVec half = splat(0.5f * (kBlockSide - 1) + packet.frame.grid_margin);
        for (int k = 0; k < 4; ++k) most_[k] = (abs(p.a[k]) + abs(p.b[k])) * half;
        most_[kDepthPlane] = most_[kDepthPlane] + p.error;
    }

    /// The values at the block in a place, from ray l on.
    HWY_INLINE ItemValues at(std::size_t place, std::size_t l) const {
        const auto value = [&](int k)
                               HWY_ATTR { return more_[k][l / kLanes] + splat(middle_[k][place]); };
        return {min3(value(0), value(1), value(2)), value(kDepthPlane)};
    }

    /// Returns the blocks with a ray that may hit the triangle nearer than its candidate, as a word
    /// of four rows from first_row on. rows: those to look at, the first ones, as bits. place:
    /// where the values of the first block go.
    HWY_INLINE std::uint64_t blocks_met(std::uint32_t first_row, std::uint32_t rows,
                                        std::size_t place) {
        const GridPlanes& p = planes_;
        std::uint64_t met = 0;
        for (std::uint32_t i = 0; i < 4 && (rows >> i & 1) != 0; ++i) {
            const FloatVec y = splat(kGrid.middle[first_row + i]);
            for (std::size_t k = 0; k < kVectors; ++k) {
                const std::size_t l = i * kGridSide + k * kLanes;
                FloatVec v[4];
                for (int n = 0; n < 4; ++n) {
                    v[n] = mul_add(p.b[n], y, at_column_[n][k]);
                    store(v[n], middle_[n] + place + l);
                }
                const FloatVec least = min3(v[0] + most_[0], v[1] + most_[1], v[2] + most_[2]);
                const Mask inside = least >= -p.bound;
                const Mask near = v[kDepthPlane] + most_[kDepthPlane] >=
                                  load(packet_.block_q + first_row * kGridSide + l);
                met |= std::uint64_t{bits_of(inside & near)} << l;
            }
        }
        return met & columns_;
    }

private:
    static constexpr std::size_t kVectors = kGridSide / kLanes;

    const CameraPacket& packet_;
    const GridPlanes& planes_;
    std::uint64_t columns_;
    FloatVec more_[4][kBlockRays / kLanes], at_column_[4][kVectors];
    /// How much larger a value is at a ray of a block than in its middle, at most.
    FloatVec most_[4];
    alignas(64) float middle_[4][8 * kGridSide];
};

// ---- Leaves

class CameraLeaves {
public:
    explicit CameraLeaves(CameraPacket& packet)
        : packet_(packet), frame_(packet.frame), deferred_(packet) {}

    /// Tests a leaf, whose box may concern some blocks and, of their rays, those in some pixels.
    HWY_INLINE void trace(const Leaf& leaf, const BlockSet& blocks, const PixelRectangle& pixels) {
        const std::uint32_t first_candidate = next_candidate();
        CameraTriangles triangles;
        std::uint32_t alive = TriangleSetup<true>(frame_, pixels).run(leaf, triangles);
        const std::uint32_t unoriented = alive & triangles.unoriented;
        if (HWY_UNLIKELY(unoriented != 0)) {
            trace_unoriented(leaf, triangles, unoriented, blocks, first_candidate);
            alive &= ~unoriented;
        }
        // Triangles of one kind follow each other, so that fewer branches are mispredicted.
        const std::uint32_t few = alive & triangles.few;
        bool any_closer = trace_few(leaf, triangles, few, first_candidate);
        any_closer |= trace_many(leaf, triangles, alive & ~few, blocks, first_candidate);
        if (!any_closer && uncertain_count_ == 0) return;
        for (std::size_t w = 0; w < kGridWords; ++w) traced_.words[w] |= blocks.words[w];
        if (HWY_UNLIKELY(uncertain_count_ != 0)) defer(leaf, first_candidate);
        if (any_closer && first_candidate == next_candidate()) add_hit_leaf(packet_, leaf);
    }

    HWY_NOINLINE void resolve() {
        deferred_.resolve(traced_);
        uncertain_blocks_ = {};
    }

    void find_depths() {
        for (std::uint32_t w = 0; w < kGridWords; ++w) {
            std::uint64_t blocks = traced_.words[w];
            for (auto count = static_cast<int>(hwy::PopCount(blocks)); count > 0; count -= 4) {
                std::uint32_t four[4];
                for (std::uint32_t& block : four) {
                    block = 64 * w + first_bit(blocks);
                    const std::uint64_t rest = blocks & (blocks - 1);
                    blocks = rest != 0 ? rest : blocks;
                }
                find_four_depths(packet_, four);
            }
        }
        traced_ = {};
    }

    /// The blocks with deferred rays, whose depths cull less until these are resolved.
    const BlockSet& uncertain_blocks() const { return uncertain_blocks_; }

private:
    /// The first candidate of the leaf that is appended next.
    std::uint32_t next_candidate() const {
        return triangle_at(static_cast<std::uint32_t>(packet_.hit_leaves.size()), 0);
    }

    /// Tests a triangle against all rays of a block, by its values_at(l). Returns whether it
    /// becomes the closest candidate of any ray for certain. One that is hit for certain bounds the
    /// depth of further hits, though it may be uncertain whether it is the closest.
    template <class ValuesAt>
    HWY_INLINE bool trace_item(const GridPlanes& p, ValuesAt values_at, std::uint32_t block,
                               std::uint32_t candidate) {
        CameraPacket& packet = packet_;
        bool any_closer = false;
        for (std::size_t l = 0; l < kBlockRays; l += kLanes) {
            const std::size_t r = block * kBlockRays + l;
            const FloatVec lower = load(packet.q_lower + r);
            const FloatVec upper = load(packet.q_upper + r);
            const auto [least, q] = values_at(l);
            const Mask inside = least > p.bound;
            const FloatVec own_lower = zero_unless(inside, q - p.error);
            const FloatVec own_upper = q + p.error;
            const Mask is_closer = own_lower > upper;
            const Mask is_rejected = (least < -p.bound) | (own_upper < lower);
            store(max(own_lower, lower), packet.q_lower + r);
            store(select(is_closer, own_upper, upper), packet.q_upper + r);
            store_where(is_closer, candidate, packet.candidate + r);
            any_closer |= !none(is_closer);
            const Mask certain = is_closer | is_rejected;
            if (HWY_UNLIKELY(!all(certain)))
                uncertain_[uncertain_count_++] = {static_cast<std::uint32_t>(r), bits_of(!certain),
                                                  candidate};
        }
        return any_closer;
    }

    HWY_NOINLINE void defer(const Leaf& leaf, std::uint32_t first_candidate) {
        if (first_candidate == next_candidate()) add_hit_leaf(packet_, leaf);
        for (std::uint32_t i = 0; i < uncertain_count_; ++i) {
            const UncertainRays& rays = uncertain_[i];
            deferred_.add(rays.first, rays.lanes, rays.candidate);
            const std::size_t block = rays.first / kBlockRays;
            uncertain_blocks_.words[block / 64] |= std::uint64_t{1} << block % 64;
            if (deferred_.many()) resolve();
        }
        uncertain_count_ = 0;
    }

    /// Traces triangles, as bits, that meet few blocks, against these.
    HWY_INLINE bool trace_few(const Leaf& leaf, const CameraTriangles& triangles, std::uint32_t few,
                              std::uint32_t first_candidate) {
        bool any_closer = false;
        for (const std::uint32_t i : BitsOf(few)) {
            const GridPlanes planes(triangles, i);
            const std::uint32_t left = first_bit(triangles.columns[i]);
            const std::uint32_t top = first_bit(triangles.rows[i]);
            const int rows = std::popcount(triangles.rows[i]);
            const std::uint64_t met =
                (triangles.columns[i] >> left) * (kEachRow >> 16 * (4 - rows));
            for (const std::uint32_t k : BitsOf(met)) {
                const std::uint32_t block = top * kGridSide + left + k;
                const auto values_at = [&](std::size_t l) HWY_ATTR -> ItemValues {
                    const FloatVec x = load(kGrid.x[block % kGridSide] + l);
                    const FloatVec y = load(kGrid.y[block / kGridSide] + l);
                    return {planes.least_edge(x, y), planes.depth(x, y)};
                };
                any_closer |= trace_item(planes, values_at, block, first_candidate + i);
            }
            defer_if_many(leaf, first_candidate);
        }
        return any_closer;
    }

    /// Traces triangles, as bits, against `blocks`. Eight rows at a time are two words, which one
    /// loop processes: its mispredicted end costs as much as an item.
    HWY_INLINE bool trace_many(const Leaf& leaf, const CameraTriangles& triangles,
                               std::uint32_t many, const BlockSet& blocks,
                               std::uint32_t first_candidate) {
        bool any_closer = false;
        for (const std::uint32_t i : BitsOf(many)) {
            const GridPlanes planes(triangles, i);
            RowPlanes grid(packet_, planes, triangles.columns[i]);
            const std::uint32_t rows = triangles.rows[i];
            for (std::uint32_t row = first_bit(rows); rows >> row != 0; row += 8) {
                const std::uint32_t first = row * kGridSide;
                std::uint32_t place = 0;
                std::uint64_t met = grid.blocks_met(row, rows >> row, 0) & four_rows(blocks, row);
                std::uint64_t next = 0;
                if (rows >> row >> 4 != 0)
                    next =
                        grid.blocks_met(row + 4, rows >> row >> 4, 64) & four_rows(blocks, row + 4);
                while ((met | next) != 0) {
                    if (met == 0) {
                        place = 64;
                        met = std::exchange(next, 0);
                    }
                    const std::uint32_t k = place + first_bit(met);
                    const auto values_at = [&](std::size_t l) HWY_ATTR { return grid.at(k, l); };
                    any_closer |= trace_item(planes, values_at, first + k, first_candidate + i);
                    met &= met - 1;
                }
            }
            defer_if_many(leaf, first_candidate);
        }
        return any_closer;
    }

    /// Traces unoriented triangles against these blocks; rays that may hit them are deferred.
    HWY_NOINLINE void trace_unoriented(const Leaf& leaf, const CameraTriangles& triangles,
                                       std::uint32_t unoriented, const BlockSet& blocks,
                                       std::uint32_t first_candidate) {
        for (const std::uint32_t i : BitsOf(unoriented)) {
            const GridPlanes planes(triangles, i);
            for (std::uint32_t w = 0; w < kGridWords; ++w) {
                for (const std::uint32_t bit : BitsOf(blocks.words[w])) {
                    const std::uint32_t block = 64 * w + bit;
                    const float* const x = kGrid.x[block % kGridSide];
                    const float* const y = kGrid.y[block / kGridSide];
                    for (std::uint32_t l = 0; l < kBlockRays; l += kLanes) {
                        const std::uint32_t uncertain =
                            bits_of(planes.may_be_inside(load(x + l), load(y + l)));
                        if (HWY_LIKELY(uncertain == 0)) continue;
                        uncertain_[uncertain_count_++] = {block * kBlockRays + l, uncertain,
                                                          first_candidate + i};
                    }
                    defer_if_many(leaf, first_candidate);
                }
            }
        }
    }

    HWY_INLINE void defer_if_many(const Leaf& leaf, std::uint32_t first_candidate) {
        if (HWY_UNLIKELY(uncertain_count_ >= kManyUncertain)) defer(leaf, first_candidate);
    }

    /// The blocks of four rows from `row` on, as a word.
    static HWY_INLINE std::uint64_t four_rows(const BlockSet& blocks, std::uint32_t row) {
        const std::uint32_t word = row / 4;
        const std::uint32_t shift = row % 4 * kGridSide;
        if (word >= kGridWords) return 0;
        const std::uint64_t after = word + 1 < kGridWords ? blocks.words[word + 1] : 0;
        return blocks.words[word] >> shift | after << 1 << (63 - shift);
    }

    CameraPacket& packet_;
    const CameraFrame& frame_;
    DeferredRays deferred_;
    /// Rays `lanes` from `first` on and a triangle that is uncertain about them.
    struct UncertainRays {
        std::uint32_t first, lanes, candidate;
    };
    static constexpr std::uint32_t kManyUncertain = 64;
    UncertainRays uncertain_[kManyUncertain + kCameraRays / kLanes];
    std::uint32_t uncertain_count_ = 0;
    /// The blocks of the leaves visited since depths were found. A triangle may be traced against
    /// other blocks as well: their depths are not updated, and cull less.
    BlockSet traced_ = {};
    BlockSet uncertain_blocks_ = {};
};

// ---- The tree

class CameraPacketTracer {
public:
    /// The blocks, and the pixels, that a box may concern.
    struct ActiveRays {
        BlockSet blocks;
        PixelRectangle pixels;
    };

    /// kWhereItPays: the traversal ends without answers if the first leaves are smaller than
    /// pixels.
    CameraPacketTracer(CameraPacket& packet, PacketUse use)
        : packet_(packet), use_(use), leaves_(packet) {
        packet.leaf_count = 0;
    }

    ActiveRays all() const {
        const auto last = [](std::uint32_t blocks) {
            return static_cast<std::uint8_t>(blocks * kBlockSide - 1);
        };
        const CameraFrame& frame = packet_.frame;
        ActiveRays all = {{}, {0, last(frame.grid_columns), 0, last(frame.grid_rows)}};
        for (std::uint64_t& word : all.blocks.words) word = kAllBlocks;
        return all;
    }
    const PacketFrame& frame() const { return packet_.frame; }

    HWY_INLINE bool narrow(float q, bool is_node, ActiveRays& active) {
        std::size_t count = 0;
        for (const std::uint64_t word : active.blocks.words) count += hwy::PopCount(word);
        if (count <= kFewBlocks)
            return still_matters(active.blocks, [&]() HWY_ATTR { return keep_rays(q, active); });
        if (is_node) leaves_.find_depths();
        return still_matters(active.blocks, [&]() HWY_ATTR { return keep_near(q, active.blocks); });
    }

    HWY_INLINE std::uint32_t find_active(const NodeChildren& children, std::uint32_t slots,
                                         const ActiveRays& active, ActiveRays* active_at) const {
        // The columns and rows of blocks within grid_margin of the rectangles, and their pixels.
        alignas(64) PerSlot<std::uint32_t> columns, rows;
        alignas(64) PerSlot<PixelRectangle> pixels_of;
        const float margin = packet_.frame.grid_margin;
        const PixelRectangle& pixels = active.pixels;
        const Rectangles& r = children.rectangles;
        for (std::size_t l = 0; l < kWidth; l += kLanes) {
            const PixelRange x(load(r.lower_x + l), load(r.upper_x + l), margin, pixels.first_x,
                               pixels.last_x);
            const PixelRange y(load(r.lower_y + l), load(r.upper_y + l), margin, pixels.first_y,
                               pixels.last_y);
            store(x.blocks(), columns + l);
            store(y.blocks(), rows + l);
            alignas(64) std::uint32_t own[kLanes];
            store(x.pixels() | shift_left<16>(y.pixels()), own);
            std::memcpy(pixels_of + l, own, sizeof own);
        }
        std::uint32_t kept = 0;
        for (const std::uint32_t slot : BitsOf(slots)) {
            if (!blocks_of_grid(columns[slot], rows[slot], active.blocks, active_at[slot].blocks))
                continue;
            active_at[slot].pixels = pixels_of[slot];
            kept |= 1u << slot;
        }
        return kept;
    }

    HWY_INLINE bool visit_leaf(const Leaf& leaf, float /*q*/, const ActiveRays& active) {
        if (packet_.leaf_count < kFirstLeaves) {
            pixels_of_leaves_ += active.pixels.count();
        } else if (packet_.leaf_count == kFirstLeaves && use_ == PacketUse::kWhereItPays &&
                   pixels_of_leaves_ < kFirstLeaves * kFewPixels) {
            return false;
        }
        ++packet_.leaf_count;
        leaves_.trace(leaf, active.blocks, active.pixels);
        return true;
    }

    /// Gives the rays that are still uncertain their closest candidates.
    void finish() { leaves_.resolve(); }

private:
    /// A packet is given up if its first leaves concern fewer pixels than kFewPixels each
    /// (lab/notes/cpu_tracer.md).
    static constexpr std::uint32_t kFirstLeaves = 32;
    static constexpr std::uint32_t kFewPixels = 2;

    /// Calls keep(), which removes blocks whose rays all have closer hits and returns whether any
    /// remain. Returns the same. If only blocks with uncertain rays remain, resolves these first.
    template <class Keep>
    HWY_INLINE bool still_matters(const BlockSet& blocks, Keep keep) {
        std::uint64_t any = keep();
        std::uint64_t certain = 0;
        for (std::size_t w = 0; w < kGridWords; ++w)
            certain |= blocks.words[w] & ~leaves_.uncertain_blocks().words[w];
        if (HWY_UNLIKELY(certain == 0 && any != 0)) {
            leaves_.resolve();
            leaves_.find_depths();
            any = keep();
        }
        return any != 0;
    }

    /// With more blocks, testing their rays costs more than it saves (lab/notes/cpu_tracer.md).
    static constexpr std::size_t kFewBlocks = 4;

    /// keep_near() ray by ray, for few blocks. Among triangles that are smaller than pixels most
    /// rays of a block miss the box or hit something nearer.
    HWY_INLINE std::uint64_t keep_rays(float q, ActiveRays& active) const {
        std::uint64_t any = 0;
        constexpr std::uint32_t kWordSide = kCameraSide / kGridWords;
        for (std::uint32_t w = active.pixels.first_y / kWordSide;
             w <= active.pixels.last_y / kWordSide; ++w) {
            std::uint64_t keep = 0;
            for (const std::uint32_t bit : BitsOf(active.blocks.words[w])) {
                const bool beyond = rays_beyond(packet_, q, 64 * w + bit, active.pixels) != 0;
                keep |= std::uint64_t{beyond} << bit;
            }
            active.blocks.words[w] = keep;
            any |= keep;
        }
        return any;
    }

    HWY_INLINE std::uint64_t keep_near(float q, BlockSet& blocks) const {
        std::uint64_t any = 0;
        for (std::size_t w = 0; w < kGridWords; ++w) {
            std::uint64_t near = 0;
            for (std::size_t b = 0; b < 64; b += kLanes) {
                const FloatVec least = load(packet_.block_q + 64 * w + b);
                near |= std::uint64_t{bits_of(splat(q) >= least)} << b;
            }
            blocks.words[w] &= near;
            any |= blocks.words[w];
        }
        return any;
    }

    CameraPacket& packet_;
    PacketUse use_;
    CameraLeaves leaves_;
    std::uint32_t pixels_of_leaves_ = 0;
};

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
