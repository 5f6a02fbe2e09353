// Rows of samples from hits to colours: the triangles that a row shows; the colours of textures;
// pixels from samples; the rows of lit samples; rows of pixels.
#include "cpu/image/lit_shader.h"

#include <algorithm>
#include <bit>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "cpu/image/lit_shader.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/base/aligned_vector.h"
#include "cpu/image/triangle_corners-inl.h"
#include "cpu/simd/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu::HWY_NAMESPACE {

// ---- Triangles

/// Loads the normals at the corners of triangles, on the side of the flat normals.
HWY_INLINE void load_corner_normals(const LitSamples& samples, UintVec prim,
                                    const lanes::Float3& flat, lanes::Float3 corners[3]) {
    UintVec ids[3];
    const std::span<const uvec3> triangles = samples.view.normals->ids();
    const std::span<const vec3> normals = samples.view.normals->normals();
    load_threes(kUints, &triangles.front().x, prim, triangles.size(), ids);
    for (int k = 0; k < 3; ++k) {
        const auto is_flat = ids[k] == splat(kFlatCorner);
        FloatVec n[3];
        load_threes(kFloats, &normals.front().x, zero_unless(!is_flat, ids[k]), normals.size(), n);
        corners[k] = select(is_flat, flat, lanes::corner_normal(lanes::Float3(n), flat));
    }
}

/// The triangles of a row, each loaded once for neighbouring samples. A run begins where a sample
/// has another triangle than the hit before it; samples without a hit belong to the run before
/// them, or to the first one.
class TriangleRuns {
public:
    /// Finds the runs of a row of `width` samples and loads their triangles. Returns false if it
    /// has no hits.
    bool find(const LitSamples& samples, const Hit* row, std::size_t width) {
        if (!split(row, width)) return false;
        const std::size_t size = (count_ + kLanes - 1) / kLanes * kLanes + kLanes;
        if (albedo_.size() < size) {
            albedo_.resize(size);
            for (auto& plane : std::span(planes_).first(samples.view.normals == nullptr ? 3 : 12))
                plane.resize(size);
        }
        has_degenerate_ = false;
        for (std::size_t at = 0; at < count_; at += kLanes) load(samples, at);
        return true;
    }

    bool has_degenerate() const { return has_degenerate_; }

    /// Looks up values of the runs of samples x and following, one a lane.
    class RunLookup {
    public:
        RunLookup(const TriangleRuns& runs, std::size_t x)
            : first_(runs.run_of_[x]),
              indices_(hn::IndicesFromVec(kUints, load_unaligned(&runs.run_of_[x]) -
                                                      splat(static_cast<std::uint32_t>(first_)))) {}

        UintVec operator()(const AlignedVector<std::uint32_t>& plane) const {
            return hn::TableLookupLanes(load_unaligned(plane.data() + first_), indices_);
        }
        FloatVec operator()(const AlignedVector<float>& plane) const {
            const FloatVec values = load_unaligned(plane.data() + first_);
            return as_float(hn::TableLookupLanes(as_uint(values), indices_));
        }

    private:
        std::size_t first_;
        decltype(hn::IndicesFromVec(kUints, UintVec())) indices_;
    };

    /// The flat normal, on the triangle's own side; 0 if its edges have no cross product.
    lanes::Float3 flat(const RunLookup& at) const { return three(at, 0); }
    /// The normal at corner k, on that side, with normal_ids; undefined where the flat one is 0.
    lanes::Float3 corner(const RunLookup& at, std::size_t k) const { return three(at, 3 + 3 * k); }
    UintVec albedo(const RunLookup& at) const { return at(albedo_); }

private:
    bool split(const Hit* row, std::size_t width) {
        const auto is_hit = [](const Hit& hit) { return hit.prim_id != kNoPrim; };
        const Hit* const first = std::find_if(row, row + width, is_hit);
        if (first == row + width) return false;
        // Lanes after the last sample are read, too.
        run_of_.resize(width + kLanes);
        prims_.resize(width + kLanes);
        std::uint32_t prim = first->prim_id;
        std::uint32_t run = 0;
        prims_[0] = prim;
        for (std::size_t x = 0; x < width; ++x) {
            const std::uint32_t here = row[x].prim_id;
            const bool is_next = here != prim && here != kNoPrim;
            prim = is_next ? here : prim;
            run += is_next ? 1 : 0;
            prims_[run] = prim;
            run_of_[x] = run;
        }
        std::fill_n(&run_of_[width], kLanes, run);
        count_ = std::size_t{run} + 1;
        std::fill_n(&prims_[count_], kLanes, prim);
        return true;
    }

    void load(const LitSamples& samples, std::size_t at) {
        const UintVec prim = load_unaligned(&prims_[at]);
        lanes::Float3 v[3];
        load_corners(samples.topology, samples.positions, prim, v);
        const lanes::Float3 across = cross3(v[1] - v[0], v[2] - v[0]);
        const lanes::Float3 flat = lanes::unit(across);
        store3(flat, planes_, at);
        store(hn::GatherIndex(kUints, samples.topology.albedo.data(), as_int(prim)),
              albedo_.data() + at);
        has_degenerate_ =
            has_degenerate_ || !hn::AllTrue(kFloats, largest_component(across) > zero());
        if (samples.view.normals == nullptr) return;
        lanes::Float3 corners[3];
        load_corner_normals(samples, prim, flat, corners);
        for (std::size_t k = 0; k < 3; ++k) store3(corners[k], planes_ + 3 + 3 * k, at);
    }

    lanes::Float3 three(const RunLookup& at, std::size_t plane) const {
        return {at(planes_[plane]), at(planes_[plane + 1]), at(planes_[plane + 2])};
    }

    /// The run of each sample, and triangle and albedo of each run.
    AlignedVector<std::uint32_t> run_of_, prims_, albedo_;
    /// x, y and z of the flat normal and of those at the corners, if they are smooth.
    AlignedVector<float> planes_[12];
    std::size_t count_ = 0;
    bool has_degenerate_ = false;
};

// ---- Samples that may be in shadow only because triangles are flat

/// The lanes whose smooth surface differs and faces the light. Lane i has the hit x[i] of row y.
HWY_INLINE Mask is_smooth_lit(const LitSamples& s, const std::uint32_t* x, std::uint32_t y) {
    alignas(64) Hit hits[kLanes];
    const Hit* const row = &s.hits[std::size_t{y} * s.view.params.width];
    for (std::size_t i = 0; i < kLanes; ++i) hits[i] = row[x[i]];
    FloatVec t, u, v, prim;
    hn::LoadInterleaved4(kFloats, &hits[0].t, t, u, v, prim);
    const Camera& camera = s.view.params.camera;
    const lanes::Float3 dir =
        lanes::canonical_direction(lanes::camera_direction(camera, load_unaligned(x), splat(y)));
    lanes::Float3 corners[3], normals[3];
    load_corners(s.topology, s.positions, as_uint(prim), corners);
    const lanes::Surface flat =
        lanes::surface_of(lanes::Float3(camera.org), dir, t, corners[0], corners[1], corners[2]);
    load_corner_normals(s, as_uint(prim), flat.normal, normals);
    const lanes::Surface above = lanes::smooth_surface(flat, corners[0], corners[1], corners[2],
                                                       normals[0], normals[1], normals[2], u, v);
    return lanes::may_see_light(flat, above, lanes::Float3(s.view.params.light));
}

void find_flat_shadows_of_row(const LitSamples& s, std::uint32_t y,
                              std::vector<std::uint32_t>& xs) {
    xs.clear();
    const std::size_t first = std::size_t{y} * s.view.params.width;
    for (std::uint32_t x = 0; x < s.view.params.width; ++x)
        if (s.shadows[first + x] != 0 && s.hits[first + x].prim_id != kNoPrim) xs.push_back(x);
    const std::size_t count = xs.size();
    if (count == 0) return;
    // Lanes without a sample have the last one.
    xs.resize(count + kLanes - 1, xs.back());
    std::size_t kept = 0;
    for (std::size_t at = 0; at < count; at += kLanes) {
        const std::size_t used = std::min<std::size_t>(kLanes, count - at);
        std::uint32_t bits = bits_of(is_smooth_lit(s, &xs[at], y)) & ((2u << (used - 1)) - 1);
        for (; bits != 0; bits &= bits - 1)
            xs[kept++] = xs[at + static_cast<std::size_t>(std::countr_zero(bits))];
    }
    xs.resize(kept);
}

// ---- Textures

/// Returns the part of the light that triangles with these albedos reflect: the colours, multiplied
/// by the texture where they have one. through, depth: as in TexturedSample. A sample without a hit
/// has a depth of 0 or less, and its colour is unspecified.
HWY_INLINE lanes::Float3 base_colours(const LitSamples& s, UintVec albedo, UintVec prim, FloatVec u,
                                      FloatVec v, const lanes::Float3& through, FloatVec depth) {
    const lanes::Float3 base = lanes::albedo_colour(albedo);
    const auto is_textured = (albedo & kTexturedBit) == splat(kTexturedBit);
    if (HWY_LIKELY(none(is_textured))) return base;
    alignas(64) std::uint32_t bits[kLanes], prims[kLanes];
    alignas(64) float at_u[kLanes], at_v[kLanes], depths[kLanes], dirs[3][kLanes];
    alignas(64) float colours[3][kLanes] = {};
    store(albedo, bits);
    store(prim, prims);
    store(u, at_u);
    store(v, at_v);
    store(depth, depths);
    store3(through, dirs, 0);
    const vec3 du = s.view.params.camera.du;
    const double spacing_squared = double{du.x} * du.x + double{du.y} * du.y + double{du.z} * du.z;
    // Texels lie anywhere in memory, and samples differ in textures and levels: one by one.
    for (std::size_t l = 0; l < kLanes; ++l) {
        if ((bits[l] & kTexturedBit) == 0 || !(depths[l] > 0.0f)) continue;
        const uvec3 t = s.topology.triangles[prims[l]];
        const TextureLookup at = texture_lookup(
            s.textures, {.prim = prims[l],
                         .u = at_u[l],
                         .v = at_v[l],
                         .corners = {s.positions[t.x], s.positions[t.y], s.positions[t.z]},
                         .through = {dirs[0][l], dirs[1][l], dirs[2][l]},
                         .depth = depths[l],
                         .spacing_squared = spacing_squared});
        const uvec3 colour = at.texture->colour_within(at.u, at.v, at.level);
        for (int k = 0; k < 3; ++k) colours[k][l] = static_cast<float>(colour[k]);
    }
    const lanes::Float3 texture(load(colours[0]), load(colours[1]), load(colours[2]));
    return select(float_mask(is_textured), lanes::textured_colour(base, texture), base);
}

// ---- Pixels from samples

/// The squares of 8-bit channels, which are linear intensities, summed over the samples of pixels.
class PixelSums {
public:
    PixelSums(std::size_t width, std::uint32_t side) : side_(side) {
        for (auto& plane : sums_) plane.resize((width + kLanes - 1) / kLanes * kLanes + 2 * kLanes);
    }

    void clear() {
        for (auto& plane : sums_) std::fill(plane.begin(), plane.end(), 0u);
    }

    void add(const std::uint32_t* colours, std::size_t width) {
        for (std::size_t x = 0; x < width; x += kLanes) {
            const UintVec colour = load_unaligned(colours + x);
            for (std::uint32_t k = 0; k < 3; ++k) {
                const UintVec channel = (colour >> (8 * k)) & 0xFFu;
                std::uint32_t* const at = sums_[k].data() + x;
                store_unaligned(load_unaligned(at) + channel * channel, at);
            }
        }
    }

    void write(std::size_t width, std::uint32_t* pixels) {
        for (std::uint32_t pairs = side_; pairs > 1; pairs /= 2) {
            const std::size_t count = width * (pairs / 2);
            for (auto& plane : sums_) {
                std::uint32_t* const at = plane.data();
                for (std::size_t x = 0; x < count; x += kLanes) {
                    UintVec even, odd;
                    hn::LoadInterleaved2(kUints, at + 2 * x, even, odd);
                    store_unaligned(even + odd, at + x);
                }
            }
        }
        const float share = sample_share(side_);
        for (std::size_t x = 0; x < width; x += kLanes) {
            const auto sum = [&](std::size_t k) { return load_unaligned(sums_[k].data() + x); };
            const UintVec colour = lanes::mean_colour(sum(0), sum(1), sum(2), share);
            if (width - x >= kLanes) {
                store_unaligned(colour, pixels + x);
            } else {
                alignas(64) std::uint32_t last[kLanes];
                store(colour, last);
                std::copy_n(last, width - x, pixels + x);
            }
        }
    }

private:
    std::uint32_t side_;
    AlignedVector<std::uint32_t> sums_[3];
};

// ---- Rows of samples

// The square of samples whose occlusion is averaged, from a sample on.
inline constexpr int kSquareBefore = static_cast<int>(kAoSquareBefore);
inline constexpr int kSquareAfter = static_cast<int>(kAoSquareSide) - 1 - kSquareBefore;

// Samples without a hit before the first and after the last one of a row.
inline constexpr std::size_t kPad = std::max<std::size_t>(kLanes, kAoSquareSide);

struct SampleLanes {
    UintVec x, y;
    /// True where the sample has a hit. Elsewhere t, u and v are undefined, and prim is 0.
    Mask visible;
    FloatVec t, u, v;
    UintVec prim;
};

/// The surfaces of a row, with kPad samples without a hit before the first and after the last one.
/// Normals belong to triangles, on the side of the eye; depths are along the viewing direction, -1
/// without a hit; `occluded` are numbers of rays.
struct SurfaceRow {
    AlignedVector<float> normal[3], depth, occluded;
    TriangleRuns runs;

    void resize(std::size_t width) {
        const std::size_t size = (width + kLanes - 1) / kLanes * kLanes + 2 * kPad;
        for (AlignedVector<float>& axis : normal) axis.assign(size, 0.0f);
        occluded.assign(size, 0.0f);
        depth.assign(size, -1.0f);
    }
};

class LitRows {
public:
    LitRows(const LitSamples& samples, std::uint32_t begin, std::uint32_t end, bool with_linear)
        : s_(samples),
          width_(samples.view.params.width),
          height_(samples.view.params.height),
          side_bits_(std::countr_zero(samples.view.side)),
          colours_((width_ + kLanes - 1) / kLanes * kLanes) {
        if (with_linear)
            for (AlignedVector<float>& plane : linear_) plane.resize(colours_.size());
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
        if (s_.view.kind == LitKind::kPlain) {
            std::copy_n(&s_.colours[std::size_t{y} * width_], width_, colours_.begin());
            return colours_.data();
        }
        if (!has_neighbours()) find_surfaces(y, rows_[0]);
        for (std::uint32_t x = 0; x < width_; x += kLanes) {
            const SampleLanes samples = load_samples(x, y);
            const float height = image_height(y, height_);
            UintVec colour = splat(kNoColour);
            if (s_.view.kind == LitKind::kLit) {
                colour = light(samples, splat(height));
            } else if (!none(samples.visible)) {
                colour = select(uint_mask(samples.visible), false_colour(samples), colour);
            }
            store_unaligned(colour, colours_.data() + x);
        }
        return colours_.data();
    }

    /// A channel of the linear colours of the row that was shaded last.
    const float* linear(std::size_t channel) const { return linear_[channel].data(); }

private:
    bool has_neighbours() const { return s_.view.ao_count > 0; }

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
        if (!row.runs.find(s_, &s_.hits[std::size_t{y} * width_], width_)) {
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
                lanes::camera_direction(s_.view.params.camera, samples.x, samples.y);
            const lanes::Float3 dir = lanes::canonical_direction(through);
            const lanes::Float3 n = own_normals(row.runs, {row.runs, x}, dir);
            const lanes::Float3 normal = select(dot3(n, dir) > zero(), -n, n);
            const FloatVec depth = lanes::depth_of(samples.t, through);
            store3(normal, row.normal, at);
            store(select(samples.visible, depth, -1.0f), row.depth.data() + at);
            if (!has_neighbours()) continue;
            const std::uint32_t* const occlusion = &s_.occlusion[std::size_t{y} * width_ + x];
            for (std::uint32_t i = 0; i < std::min<std::uint32_t>(kLanes, width_ - x); ++i)
                row.occluded[at + i] = static_cast<float>(occlusion[i]);
        }
    }

    /// The flat normals of samples that canonical rays dir hit, on the own side of triangles.
    static lanes::Float3 own_normals(const TriangleRuns& runs, const TriangleRuns::RunLookup& at,
                                     const lanes::Float3& dir) {
        const lanes::Float3 n = runs.flat(at);
        if (HWY_LIKELY(!runs.has_degenerate())) return n;
        return select(largest_component(n) > zero(), n, lanes::unit(dir));
    }

    const SurfaceRow& row(std::uint32_t y) const {
        return rows_[has_neighbours() ? static_cast<std::size_t>(std::int64_t{y} - first_row_) : 0];
    }

    static lanes::Float3 normal_at(const SurfaceRow& row, std::size_t at) {
        return {load_unaligned(&row.normal[0][at]), load_unaligned(&row.normal[1][at]),
                load_unaligned(&row.normal[2][at])};
    }

    FloatVec open_of(const SampleLanes& samples, const lanes::Float3& n,
                     const lanes::Float3& through, FloatVec depth) const {
        if (!has_neighbours()) return splat(1.0f);
        const lanes::SamplePlane plane =
            lanes::sample_plane(s_.view.params.camera, n, through, depth);
        FloatVec occluded = zero();
        FloatVec count = zero();
        const std::uint32_t x = hn::GetLane(samples.x);
        const std::uint32_t y = hn::GetLane(samples.y);
        for (int dy = -kSquareBefore; dy <= kSquareAfter; ++dy) {
            const std::int64_t at_y = std::int64_t{y} + dy;
            if (at_y < 0 || at_y >= std::int64_t{height_}) continue;
            const SurfaceRow& other = row(static_cast<std::uint32_t>(at_y));
            for (int dx = -kSquareBefore; dx <= kSquareAfter; ++dx) {
                const std::size_t at = static_cast<std::size_t>(std::int64_t{x} + dx) + kPad;
                const Mask counts = lanes::is_in_plane(plane, static_cast<float>(dx),
                                                       static_cast<float>(dy), normal_at(other, at),
                                                       load_unaligned(other.depth.data() + at));
                occluded =
                    occluded + zero_unless(counts, load_unaligned(other.occluded.data() + at));
                count = count + zero_unless(counts, splat(1.0f));
            }
        }
        return lanes::openness(occluded,
                               max(count, splat(1.0f)) * static_cast<float>(s_.view.ao_count));
    }

    /// The unit normals to shade with, on the side of the eye; `flat`: those of the triangles.
    lanes::Float3 shading_normals(const SampleLanes& samples, const TriangleRuns& runs,
                                  const TriangleRuns::RunLookup& at, const lanes::Float3& through,
                                  const lanes::Float3& flat) const {
        if (s_.view.normals == nullptr) return flat;
        const lanes::Float3 dir = lanes::canonical_direction(through);
        const lanes::Float3 own = own_normals(runs, at, dir);
        lanes::Float3 corners[3] = {runs.corner(at, 0), runs.corner(at, 1), runs.corner(at, 2)};
        if (HWY_UNLIKELY(runs.has_degenerate()))
            load_corner_normals(s_, samples.prim, own, corners);
        const lanes::Float3 n =
            lanes::smooth_normal(corners[0], corners[1], corners[2], samples.u, samples.v);
        return select(dot3(own, dir) > zero(), -n, n);
    }

    /// The hits of samples of which one is visible; others are unspecified.
    lanes::ShownHit shown(const SampleLanes& samples, const SurfaceRow& own,
                          const TriangleRuns::RunLookup& place) const {
        const std::size_t at = hn::GetLane(samples.x) + kPad;
        lanes::ShownHit hit;
        hit.through = lanes::camera_direction(s_.view.params.camera, samples.x, samples.y);
        hit.flat_normal = normal_at(own, at);
        hit.normal = shading_normals(samples, own.runs, place, hit.through, hit.flat_normal);
        hit.depth = max(load_unaligned(own.depth.data() + at), zero());
        hit.prim = samples.prim;
        return hit;
    }

    UintVec false_colour(const SampleLanes& samples) const {
        const SurfaceRow& own = row(hn::GetLane(samples.y));
        const TriangleRuns::RunLookup place(own.runs, hn::GetLane(samples.x));
        return lanes::false_colour(static_cast<std::uint32_t>(s_.view.kind),
                                   shown(samples, own, place), splat(s_.view.near),
                                   splat(s_.view.per_depth));
    }

    UintVec light(const SampleLanes& samples, FloatVec height) {
        const FloatVec dithered =
            lanes::dithered_rounding(samples.x >> side_bits_, samples.y >> side_bits_);
        lanes::SampleColour colour = lanes::sky_sample(height, dithered);
        if (!none(samples.visible)) {
            const lanes::SampleColour lit = lit_hits(samples, height, dithered);
            colour.linear = select(samples.visible, lit.linear, colour.linear);
            colour.rounding = select(samples.visible, lit.rounding, colour.rounding);
        }
        if (!linear_[0].empty()) store3(colour.linear, linear_, hn::GetLane(samples.x));
        return lanes::encode_rgb(colour.linear, colour.rounding);
    }

    lanes::SampleColour lit_hits(const SampleLanes& samples, FloatVec height,
                                 FloatVec dithered) const {
        const std::size_t x = hn::GetLane(samples.x);
        const std::uint32_t y = hn::GetLane(samples.y);
        const SurfaceRow& own = row(y);
        const TriangleRuns::RunLookup place(own.runs, x);
        const lanes::ShownHit hit = shown(samples, own, place);
        alignas(64) std::uint32_t shadows[kLanes] = {};
        const std::size_t count = std::min<std::size_t>(kLanes, width_ - x);
        std::copy_n(&s_.shadows[std::size_t{y} * width_ + x], count, shadows);
        const UintVec albedo = own.runs.albedo(place);
        const lanes::Float3 base =
            base_colours(s_, albedo, hit.prim, samples.u, samples.v, hit.through, hit.depth);
        return lanes::lit_sample(hit, lanes::Float3(s_.view.params.camera.org),
                                 lanes::Float3(s_.view.params.light), lanes::Float3(s_.view.up),
                                 1.0f - lanes::to_float(load(shadows)),
                                 open_of(samples, hit.flat_normal, hit.through, hit.depth), albedo,
                                 base, height, dithered);
    }

    const LitSamples& s_;
    std::uint32_t width_, height_;
    int side_bits_;
    std::vector<SurfaceRow> rows_;
    std::int64_t first_row_ = 0;
    AlignedVector<std::uint32_t> colours_;
    /// The linear colours of the row that was shaded last, a plane a channel; empty unless asked
    /// for.
    AlignedVector<float> linear_[3];
};

/// Adds row k of the samples of a row of pixels to their means; the first row starts them, and the
/// last one ends them.
void add_linear(const LitRows& rows, std::uint32_t k, std::uint32_t side,
                std::span<LinearColour> pixels) {
    const float share = sample_share(side);
    for (std::size_t x = 0; x < pixels.size(); ++x) {
        if (k == 0) pixels[x] = {};
        for (std::size_t channel = 0; channel < 3; ++channel) {
            for (std::size_t i = 0; i < side; ++i)
                pixels[x][channel] += rows.linear(channel)[x * side + i];
            if (k == side - 1) pixels[x][channel] *= share;
        }
    }
}

void shade_lit_rows(const LitSamples& samples, std::uint32_t begin, std::uint32_t end,
                    std::uint32_t* pixels, LinearColour* linear) {
    const std::uint32_t side = samples.view.side;
    const std::size_t width = samples.view.params.width / side;
    const bool with_linear = linear != nullptr && samples.view.kind == LitKind::kLit;
    LitRows rows(samples, begin * side, end * side, with_linear);
    PixelSums sums(samples.view.params.width, side);
    for (std::uint32_t y = begin; y < end; ++y, pixels += width) {
        sums.clear();
        for (std::uint32_t k = 0; k < side; ++k) {
            const std::uint32_t* const colours = rows.shade(y * side + k);
            if (side == 1) {
                std::copy_n(colours, width, pixels);
            } else {
                sums.add(colours, samples.view.params.width);
            }
            if (with_linear) add_linear(rows, k, side, {linear, width});
        }
        if (side > 1) sums.write(width, pixels);
        if (with_linear) linear += width;
    }
}

}  // namespace mray::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "common/simd/simd_dispatch-inl.h"

namespace mray::cpu {

HWY_EXPORT(find_flat_shadows_of_row);
HWY_EXPORT(shade_lit_rows);

LitShader::LitShader(SimdTarget target)
    : shade_rows(SIMD_FUNCTION(shade_lit_rows, target)),
      find_flat_shadows(SIMD_FUNCTION(find_flat_shadows_of_row, target)) {}

}  // namespace mray::cpu

#endif  // HWY_ONCE
