// The triangles that a row of samples shows, each loaded once for all its neighbouring samples.
#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/aligned_vector.h"
#include "cpu/image/lit_shader.h"
#include "cpu/image/shown_triangles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace mray::cpu {
namespace HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// Loads the normals at the corners of triangles, on the side of the flat normals.
HWY_INLINE void load_corner_normals(const LitSamples& samples, UintVec prim,
                                    const lanes::Float3& flat, lanes::Float3 corners[3]) {
    UintVec ids[3];
    load_threes(kUints, &samples.normal_ids.front().x, prim, samples.normal_ids.size(), ids);
    for (int k = 0; k < 3; ++k) {
        const auto is_flat = ids[k] == splat(kFlatCorner);
        FloatVec n[3];
        load_threes(kFloats, &samples.normals.front().x, zero_unless(!is_flat, ids[k]),
                    samples.normals.size(), n);
        corners[k] = select(is_flat, flat, lanes::corner_normal(lanes::Float3(n), flat));
    }
}

/// A run is the samples of a row from one with another triangle than the hit before it up to the
/// next such sample; samples without a hit belong to the run before them, or to the first one.
class TriangleRuns {
public:
    /// Finds the runs of a row of `width` samples and loads their triangles.
    void find(const LitSamples& samples, const Hit* row, std::size_t width) {
        if (!split(row, width)) return;
        reserve((count_ + kLanes - 1) / kLanes * kLanes + kLanes, !samples.normal_ids.empty());
        has_degenerate_ = false;
        for (std::size_t at = 0; at < count_; at += kLanes) load(samples, at);
    }

    bool has_hits() const { return count_ > 0; }
    bool has_degenerate() const { return has_degenerate_; }

    /// The places of the runs of samples x and following, one a lane.
    class Place {
    public:
        Place(const TriangleRuns& runs, std::size_t x)
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
    lanes::Float3 flat(const Place& at) const { return three(at, 0); }
    /// The normal at corner k, on that side, with normal_ids; undefined where the flat one is 0.
    lanes::Float3 corner(const Place& at, std::size_t k) const { return three(at, 3 + 3 * k); }
    UintVec albedo(const Place& at) const { return at(albedo_); }

private:
    /// Returns whether there is a hit.
    bool split(const Hit* row, std::size_t width) {
        count_ = 0;
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

    void reserve(std::size_t size, bool is_smooth) {
        if (albedo_.size() >= size) return;
        for (AlignedVector<float>& plane : std::span(planes_).first(is_smooth ? 12 : 3))
            plane.resize(size);
        albedo_.resize(size);
    }

    /// Loads the triangles of runs `at` and following.
    void load(const LitSamples& samples, std::size_t at) {
        const UintVec prim = load_unaligned(&prims_[at]);
        lanes::Float3 v[3];
        load_corners(samples.topology, samples.positions, prim, v);
        const lanes::Float3 across = cross3(v[1] - v[0], v[2] - v[0]);
        const lanes::Float3 flat = lanes::unit(across);
        put(flat, 0, at);
        store(hn::GatherIndex(kUints, samples.topology.albedo.data(), as_int(prim)),
              albedo_.data() + at);
        has_degenerate_ =
            has_degenerate_ || !hn::AllTrue(kFloats, largest_component(across) > zero());
        if (samples.normal_ids.empty()) return;
        lanes::Float3 corners[3];
        load_corner_normals(samples, prim, flat, corners);
        for (std::size_t k = 0; k < 3; ++k) put(corners[k], 3 + 3 * k, at);
    }

    void put(const lanes::Float3& v, std::size_t plane, std::size_t at) {
        store(v.x, planes_[plane].data() + at);
        store(v.y, planes_[plane + 1].data() + at);
        store(v.z, planes_[plane + 2].data() + at);
    }
    lanes::Float3 three(const Place& at, std::size_t plane) const {
        return {at(planes_[plane]), at(planes_[plane + 1]), at(planes_[plane + 2])};
    }

    /// The run of each sample.
    AlignedVector<std::uint32_t> run_of_;
    /// Triangle and albedo of each run.
    AlignedVector<std::uint32_t> prims_;
    AlignedVector<std::uint32_t> albedo_;
    /// x, y and z of the flat normal and of those at the corners, if they are smooth.
    AlignedVector<float> planes_[12];
    std::size_t count_ = 0;
    bool has_degenerate_ = false;
};

// The samples of a row that may be in shadow only because triangles are flat.

/// The lanes whose smooth surface differs and faces the light. Lane i has the hit x[i] of row y.
HWY_INLINE Mask is_smooth_lit(const LitSamples& s, const std::uint32_t* x, std::uint32_t y) {
    alignas(64) Hit hits[kLanes];
    const Hit* const row = &s.hits[std::size_t{y} * s.params.width];
    for (std::size_t i = 0; i < kLanes; ++i) hits[i] = row[x[i]];
    FloatVec t, u, v, prim;
    hn::LoadInterleaved4(kFloats, &hits[0].t, t, u, v, prim);
    const Camera& camera = s.params.camera;
    const lanes::Float3 dir =
        lanes::canonical_direction(lanes::camera_direction(camera, load_unaligned(x), splat(y)));
    lanes::Float3 corners[3], normals[3];
    load_corners(s.topology, s.positions, as_uint(prim), corners);
    const lanes::Surface flat =
        lanes::surface_of(lanes::Float3(camera.org), dir, t, corners[0], corners[1], corners[2]);
    load_corner_normals(s, as_uint(prim), flat.normal, normals);
    const lanes::Surface above = lanes::smooth_surface(flat, corners[0], corners[1], corners[2],
                                                       normals[0], normals[1], normals[2], u, v);
    const lanes::Float3 to_light = lanes::Float3(s.params.light) - flat.point;
    const Mask is_same = (above.point.x == flat.point.x) & (above.point.y == flat.point.y) &
                         (above.point.z == flat.point.z);
    return and_not(is_same, lanes::dot3(above.normal, to_light) > zero());
}

void find_flat_shadows_of_row(const LitSamples& s, std::uint32_t y,
                              std::vector<std::uint32_t>& xs) {
    xs.clear();
    const std::size_t first = std::size_t{y} * s.params.width;
    for (std::uint32_t x = 0; x < s.params.width; ++x)
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

}  // namespace HWY_NAMESPACE
}  // namespace mray::cpu
HWY_AFTER_NAMESPACE();
