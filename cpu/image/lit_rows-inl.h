// Rows of lit samples from hits to colours.
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/aligned_vector.h"
#include "cpu/image/lit_shader.h"
#include "cpu/image/sample_colours-inl.h"
#include "cpu/image/triangle_runs-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

// The square of samples whose occlusion is averaged: from this many before a sample on each axis.
inline constexpr int kSquareBefore = 1;
inline constexpr int kSquareAfter = static_cast<int>(kAoSquareSide) - 1 - kSquareBefore;

inline constexpr std::uint32_t kNoColour = 0xFF000000u;

// Samples without a hit before the first and after the last one of a row.
inline constexpr std::size_t kPad = std::max<std::size_t>(kLanes, kAoSquareSide);

/// Samples of a row, one a lane.
struct SampleLanes {
    UintVec x, y;
    /// True where the sample has a hit. Elsewhere t, u and v are undefined, and prim is 0.
    Mask visible;
    FloatVec t, u, v;
    UintVec prim;
};

/// The surfaces of a row. Normals are those of triangles, on the side of the eye; depths are along
/// the viewing direction, -1 without a hit; `occluded` are numbers of rays. There are kPad samples
/// without a hit before the first and after the last one.
struct SurfaceRow {
    AlignedVector<float> x, y, z, depth, occluded;
    TriangleRuns runs;

    void resize(std::size_t width) {
        const std::size_t size = (width + kLanes - 1) / kLanes * kLanes + 2 * kPad;
        for (AlignedVector<float>* of : {&x, &y, &z, &occluded}) of->assign(size, 0.0f);
        depth.assign(size, -1.0f);
    }
};

/// Shades rows of samples from the top down.
class LitRows {
public:
    LitRows(const LitSamples& samples, std::uint32_t begin, std::uint32_t end, bool with_details)
        : s_(samples),
          width_(samples.params.width),
          height_(samples.params.height),
          side_bits_(std::countr_zero(samples.side)),
          colours_((width_ + kLanes - 1) / kLanes * kLanes) {
        if (with_details)
            for (AlignedVector<float>& plane : details_) plane.resize(colours_.size());
        if (!has_neighbours()) {
            rows_.resize(1);
            rows_[0].resize(width_);
            return;
        }
        first_row_ = std::max<std::int64_t>(std::int64_t{begin} - kSquareBefore, 0);
        const std::int64_t last = std::min<std::int64_t>(std::int64_t{end} + kSquareAfter, height_);
        rows_.resize(static_cast<std::size_t>(last - first_row_));
        for (std::size_t i = 0; i < rows_.size(); ++i) {
            rows_[i].resize(width_);
            find_surfaces(static_cast<std::uint32_t>(first_row_ + static_cast<std::int64_t>(i)),
                          rows_[i]);
        }
    }

    /// The colours of a row of [begin, end); valid until the next call.
    const std::uint32_t* shade(std::uint32_t y) {
        if (s_.kind == LitKind::kPlain) {
            std::copy_n(&s_.colours[std::size_t{y} * width_], width_, colours_.begin());
            return colours_.data();
        }
        if (!has_neighbours()) find_surfaces(y, rows_[0]);
        for (std::uint32_t x = 0; x < width_; x += kLanes) {
            const SampleLanes samples = load_samples(x, y);
            const float height =
                (static_cast<float>(y) + 0.5f) * rcp_of_positive(static_cast<float>(height_));
            UintVec colour = splat(kNoColour);
            if (s_.kind == LitKind::kLit) {
                colour = light(samples, splat(height));
            } else if (!none(samples.visible)) {
                colour = select(uint_mask(samples.visible), false_colour(samples), colour);
            }
            store_unaligned(colour, colours_.data() + x);
        }
        return colours_.data();
    }

    /// Details of the samples of the row that was shaded last: colours, normals, openness.
    const float* detail(std::size_t plane) const { return details_[plane].data(); }

private:
    /// Whether a sample's colour depends on the samples around it.
    bool has_neighbours() const { return s_.ao_count > 0; }

    SampleLanes load_samples(std::uint32_t x, std::uint32_t y) const {
        const Hit* from = &s_.hits[std::size_t{y} * width_ + x];
        const std::uint32_t count = std::min<std::uint32_t>(kLanes, width_ - x);
        alignas(64) Hit partial[kLanes];
        if (count < kLanes) {
            std::copy_n(from, count, partial);
            std::fill(partial + count, partial + kLanes, no_hit());
            from = partial;
        }
        SampleLanes samples;
        FloatVec prim;
        hn::LoadInterleaved4(kFloats, &from->t, samples.t, samples.u, samples.v, prim);
        const auto is_visible = as_uint(prim) != splat(kNoPrim);
        samples.visible = float_mask(is_visible);
        samples.prim = zero_unless(is_visible, as_uint(prim));
        samples.x = hn::Iota(kUints, x);
        samples.y = splat(y);
        return samples;
    }

    void find_surfaces(std::uint32_t y, SurfaceRow& row) const {
        row.runs.find(s_, &s_.hits[std::size_t{y} * width_], width_);
        if (!row.runs.has_hits()) {
            std::fill(row.depth.begin(), row.depth.end(), -1.0f);
            return;
        }
        for (std::uint32_t x = 0; x < width_; x += kLanes) {
            const SampleLanes samples = load_samples(x, y);
            const std::size_t at = x + kPad;
            if (none(samples.visible)) {
                store(splat(-1.0f), row.depth.data() + at);
                continue;
            }
            const lanes::Float3 through =
                lanes::camera_direction(s_.params.camera, samples.x, samples.y);
            const lanes::Float3 dir = lanes::canonical_direction(through);
            const lanes::Float3 n = own_normals(row.runs, TriangleRuns::Place(row.runs, x), dir);
            const lanes::Float3 normal = select(dot3(n, dir) > zero(), -n, n);
            const FloatVec depth =
                samples.t * lanes::scale_to_unit(lanes::largest_component(through));
            store(normal.x, row.x.data() + at);
            store(normal.y, row.y.data() + at);
            store(normal.z, row.z.data() + at);
            store(select(samples.visible, depth, -1.0f), row.depth.data() + at);
            if (!has_neighbours()) continue;
            const std::uint32_t count = std::min<std::uint32_t>(kLanes, width_ - x);
            for (std::uint32_t i = 0; i < count; ++i) {
                row.occluded[at + i] =
                    static_cast<float>(s_.occlusion[std::size_t{y} * width_ + x + i]);
            }
        }
    }

    /// The flat normals of samples that canonical rays dir hit, on the own side of triangles.
    static lanes::Float3 own_normals(const TriangleRuns& runs, const TriangleRuns::Place& at,
                                     const lanes::Float3& dir) {
        const lanes::Float3 n = runs.flat(at);
        if (HWY_LIKELY(!runs.has_degenerate())) return n;
        return select(largest_component(n) > zero(), n, lanes::unit(dir));
    }

    const SurfaceRow& row(std::uint32_t y) const {
        return rows_[has_neighbours() ? static_cast<std::size_t>(std::int64_t{y} - first_row_) : 0];
    }

    static lanes::Float3 normal_at(const SurfaceRow& row, std::size_t at) {
        return {load_unaligned(row.x.data() + at), load_unaligned(row.y.data() + at),
                load_unaligned(row.z.data() + at)};
    }

    /// The share of the sky that samples see. A neighbour counts if it lies in nearly the same
    /// plane: by its normal, and by its distance from the plane, up to four samples.
    FloatVec open_of(const SampleLanes& samples, const lanes::Float3& n,
                     const lanes::Float3& through, FloatVec depth) const {
        if (s_.ao_count == 0) return splat(1.0f);
        const Camera& camera = s_.params.camera;
        const FloatVec along = lanes::dot3(n, through);
        const FloatVec along_x = lanes::dot3(n, lanes::Float3(camera.du));
        const FloatVec along_y = lanes::dot3(n, lanes::Float3(camera.dv));
        const FloatVec plane = along * depth;
        const FloatVec most = depth * splat(4.0f * mray::largest_component(camera.du));
        FloatVec occluded = zero();
        FloatVec count = zero();
        const std::uint32_t x = hn::GetLane(samples.x);
        const std::uint32_t y = hn::GetLane(samples.y);
        for (int dy = -kSquareBefore; dy <= kSquareAfter; ++dy) {
            const std::int64_t at_y = std::int64_t{y} + dy;
            if (at_y < 0 || at_y >= std::int64_t{height_}) continue;
            const SurfaceRow& other = row(static_cast<std::uint32_t>(at_y));
            const FloatVec along_row = along + along_y * static_cast<float>(dy);
            for (int dx = -kSquareBefore; dx <= kSquareAfter; ++dx) {
                const std::size_t at = static_cast<std::size_t>(std::int64_t{x} + dx) + kPad;
                const FloatVec other_depth = load_unaligned(other.depth.data() + at);
                const FloatVec beside = along_row + along_x * static_cast<float>(dx);
                const FloatVec apart = abs(beside * other_depth - plane);
                const FloatVec alike = lanes::dot3(n, normal_at(other, at));
                const Mask counts = (other_depth > 0.0f) & (alike >= 0.75f) & (apart <= most);
                occluded =
                    occluded + zero_unless(counts, load_unaligned(other.occluded.data() + at));
                count = count + zero_unless(counts, splat(1.0f));
            }
        }
        return lanes::openness(occluded, max(count, splat(1.0f)) * static_cast<float>(s_.ao_count));
    }

    /// The unit normals to shade with, on the side of the eye; `flat` are those of the triangles.
    lanes::Float3 shading_normals(const SampleLanes& samples, const TriangleRuns& runs,
                                  const TriangleRuns::Place& at, const lanes::Float3& through,
                                  const lanes::Float3& flat) const {
        if (s_.normal_ids.empty()) return flat;
        const lanes::Float3 dir = lanes::canonical_direction(through);
        const lanes::Float3 own = own_normals(runs, at, dir);
        lanes::Float3 corners[3] = {runs.corner(at, 0), runs.corner(at, 1), runs.corner(at, 2)};
        if (HWY_UNLIKELY(runs.has_degenerate()))
            load_corner_normals(s_, samples.prim, own, corners);
        const lanes::Float3 n =
            lanes::smooth_normal(corners[0], corners[1], corners[2], samples.u, samples.v);
        return select(dot3(own, dir) > zero(), -n, n);
    }

    UintVec false_colour(const SampleLanes& samples) const {
        const std::size_t at = hn::GetLane(samples.x) + kPad;
        const SurfaceRow& own = row(hn::GetLane(samples.y));
        const lanes::Float3 flat = normal_at(own, at);
        const FloatVec depth = max(load_unaligned(own.depth.data() + at), zero());
        const lanes::Float3 through =
            lanes::camera_direction(s_.params.camera, samples.x, samples.y);
        if (s_.kind == LitKind::kDepth)
            return lanes::depth_colour(depth, splat(s_.near), splat(s_.per_depth));
        if (s_.kind == LitKind::kPrim)
            return lanes::prim_colour(samples.prim, lanes::dot3(flat, lanes::unit(through)));
        const TriangleRuns::Place place(own.runs, hn::GetLane(samples.x));
        return lanes::normal_colour(shading_normals(samples, own.runs, place, through, flat));
    }

    UintVec light(const SampleLanes& samples, FloatVec height) {
        const FloatVec dithered =
            lanes::dithered_rounding(samples.x >> side_bits_, samples.y >> side_bits_);
        LitLanes lit{lanes::sky_colour(height), lanes::Float3(vec3(0.0f)), splat(1.0f), dithered};
        if (!none(samples.visible)) {
            const LitLanes surface = lit_surface(samples, height, dithered);
            lit.colour = select(samples.visible, surface.colour, lit.colour);
            lit.normal = select(samples.visible, surface.normal, lit.normal);
            lit.open = select(samples.visible, surface.open, lit.open);
            lit.rounding = select(samples.visible, surface.rounding, lit.rounding);
        }
        if (!details_[0].empty()) {
            const std::size_t x = hn::GetLane(samples.x);
            const FloatVec values[kDetails] = {lit.colour.x, lit.colour.y, lit.colour.z,
                                               lit.normal.x, lit.normal.y, lit.normal.z,
                                               lit.open};
            for (std::size_t i = 0; i < kDetails; ++i) store(values[i], details_[i].data() + x);
        }
        return lanes::encode_rgb(lit.colour, lit.rounding);
    }

    /// Linear colours, normals and openness of lit samples, and how their colours are rounded.
    struct LitLanes {
        lanes::Float3 colour;
        lanes::Float3 normal;
        FloatVec open;
        FloatVec rounding;
    };

    LitLanes lit_surface(const SampleLanes& samples, FloatVec height, FloatVec dithered) const {
        const std::size_t x = hn::GetLane(samples.x);
        const std::uint32_t y = hn::GetLane(samples.y);
        const SurfaceRow& own = row(y);
        const lanes::Float3 flat = normal_at(own, x + kPad);
        const FloatVec depth = max(load_unaligned(own.depth.data() + x + kPad), zero());
        const lanes::Float3 through =
            lanes::camera_direction(s_.params.camera, samples.x, samples.y);
        const TriangleRuns::Place place(own.runs, x);
        const lanes::Float3 n = shading_normals(samples, own.runs, place, through, flat);
        const lanes::Float3 org(s_.params.camera.org);
        const lanes::Float3 point(org.x + depth * through.x, org.y + depth * through.y,
                                  org.z + depth * through.z);
        const lanes::Float3 to_light = lanes::unit(lanes::Float3(s_.params.light) - point);
        alignas(64) std::uint32_t shadows[kLanes] = {};
        const std::size_t count = std::min<std::size_t>(kLanes, width_ - x);
        std::copy_n(&s_.shadows[std::size_t{y} * width_ + x], count, shadows);
        const FloatVec light = 1.0f - lanes::to_float(load(shadows));
        const FloatVec open = open_of(samples, flat, through, depth);
        const UintVec albedo = own.runs.albedo(place);
        const lanes::Float3 base =
            base_colours(s_, albedo, samples.prim, samples.u, samples.v, through, depth);
        LitLanes lit{lanes::lit_colour(n, to_light, light, open, lanes::Float3(s_.up), base), n,
                     open, splat(0.5f)};
        const Mask is_shadow_catcher =
            float_mask((albedo & kShadowCatcherBit) == splat(kShadowCatcherBit));
        if (!none(is_shadow_catcher)) {
            lit.colour = select(is_shadow_catcher,
                                lanes::shadow_catcher_colour(height, light, open), lit.colour);
            lit.rounding = select(is_shadow_catcher, dithered, lit.rounding);
        }
        return lit;
    }

    const LitSamples& s_;
    std::uint32_t width_;
    std::uint32_t height_;
    /// A pixel has 2^side_bits_ samples a side.
    int side_bits_;
    std::vector<SurfaceRow> rows_;
    std::int64_t first_row_ = 0;
    AlignedVector<std::uint32_t> colours_;
    static constexpr std::size_t kDetails = sizeof(LitPixel) / sizeof(float);
    /// As in LitPixel, a plane each; empty without details.
    AlignedVector<float> details_[kDetails];
};

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();
