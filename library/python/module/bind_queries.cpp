// The queries of morphray.Scene about rays and points.
#include <algorithm>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>

#include "library/python/module/bindings.h"
#include "library/python/module/scene.h"
#include "morphray/queries.hpp"

namespace morphray::python {
namespace {

using py::arg;
using Flag = std::atomic<bool>;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Results of this dtype, one a query. `work` gets them as numbers of type `Written`, which differs
/// from the dtype by a sign at most, or in name: numpy indexes and counts with signed types.
template <class Written, class Work>
py::array answer(const QueryArray& queries, const py::object& out, const py::dtype& dtype,
                 Work work) {
    py::array results = results_for(queries, out, dtype);
    assert(results.itemsize() == sizeof(Written));
    work(std::span(static_cast<Written*>(results.mutable_data()), queries.count));
    return results;
}

/// Calls `work(scene, rays, results, cancelled)` for batches of rays.
template <class Written, class Work>
py::array ask_rays(PyScene& scene, const py::object& given, Coherence coherence,
                   const py::object& out, const py::dtype& dtype, Cancel* cancel, Work work) {
    const QueryArray rays = rays_of(given);
    return answer<Written>(rays, out, dtype, [&](std::span<Written> results) {
        scene.query(rays.count, cancel, [&](const Scene& asked, const Flag* cancelled) {
            for_each_batch(rays, batch_size(rays, coherence),
                           [&](std::size_t first, std::span<const Ray> batch) {
                               work(asked, batch, results.subspan(first, batch.size()), cancelled);
                           });
        });
    });
}

/// Calls `work(scene, points, results, cancelled)`.
template <class Written, class Work>
py::array ask_points(PyScene& scene, const py::object& points, const py::object& out,
                     const py::dtype& dtype, Cancel* cancel, Work work) {
    const QueryArray array = query_points_of(points);
    const std::span where(reinterpret_cast<const Vec3*>(array.data), array.count);
    return answer<Written>(array, out, dtype, [&](std::span<Written> results) {
        scene.query(array.count, cancel, [&](const Scene& asked, const Flag* cancelled) {
            work(asked, where, results, cancelled);
        });
    });
}

/// An array that owns a vector.
template <class Number, class Element>
py::array array_of(const py::dtype& dtype, std::vector<Element> elements) {
    static_assert(sizeof(Number) == sizeof(Element));
    auto owned = std::make_unique<std::vector<Element>>(std::move(elements));
    const py::capsule owner(
        owned.get(), [](void* vector) { delete static_cast<std::vector<Element>*>(vector); });
    const std::vector<Element>& vector = *owned.release();
    return py::array(dtype, static_cast<py::ssize_t>(vector.size()), vector.data(), owner);
}

py::array intersect(PyScene& scene, const py::object& rays, const py::object& out,
                    const AnyCoherence& coherence) {
    const Coherence known = coherence_of(coherence);
    return ask_rays<Hit>(
        scene, rays, known, out, hit_dtype(), nullptr,
        [&](const Scene& asked, auto batch, std::span<Hit> hits, const Flag* cancelled) {
            asked.intersect(batch, hits, known, cancelled);
        });
}

py::array occluded(PyScene& scene, const py::object& rays, const py::object& out,
                   const AnyCoherence& coherence) {
    const Coherence known = coherence_of(coherence);
    return ask_rays<std::uint8_t>(
        scene, rays, known, out, py::dtype::of<bool>(), nullptr,
        [&](const Scene& asked, auto batch, std::span<std::uint8_t> results,
            const Flag* cancelled) { asked.occluded(batch, results, known, cancelled); });
}

py::object intersect_all(PyScene& scene, const py::object& rays, const std::string& crossing,
                         std::optional<std::uint32_t> max_hits, Cancel* cancel) {
    AllHitsOptions options{.crossing = crossing_named(crossing)};
    if (max_hits) options.max_hits = *max_hits;
    const QueryArray array = rays_of(rays);
    AllHits all;
    scene.query(array.count, cancel, [&](const Scene& asked, const Flag* cancelled) {
        options.cancel = cancelled;
        // One batch: the answer takes as much memory as converted rays.
        for_each_batch(array, array.count, [&](std::size_t, std::span<const Ray> batch) {
            all = asked.intersect_all(batch, options);
        });
    });
    const py::dtype numbers = py::dtype::of<std::int64_t>();
    py::array offsets = array_of<std::int64_t>(numbers, std::move(all.offsets));
    py::array hits = array_of<Hit>(hit_dtype(), std::move(all.hits));
    py::array left_out = array_of<std::int64_t>(numbers, std::move(all.left_out));
    return py::module_::import("morphray").attr("AllHits")(offsets, hits, left_out);
}

py::array count(PyScene& scene, const py::object& rays, const py::object& out,
                const std::string& crossing, const AnyCoherence& coherence, Cancel* cancel) {
    const Crossing rule = crossing_named(crossing);
    const Coherence known = coherence_of(coherence);
    return ask_rays<std::uint64_t>(
        scene, rays, known, out, py::dtype::of<std::int64_t>(), cancel,
        [&](const Scene& asked, auto batch, std::span<std::uint64_t> counts,
            const Flag* cancelled) { asked.count(batch, counts, rule, known, cancelled); });
}

py::array winding(PyScene& scene, const py::object& points, const py::object& out, Cancel* cancel) {
    return ask_points<std::int32_t>(
        scene, points, out, py::dtype::of<std::int32_t>(), cancel,
        [](const Scene& asked, auto where, auto windings, const Flag* cancelled) {
            asked.winding(where, windings, cancelled);
        });
}

py::array contains(PyScene& scene, const py::object& points, const py::object& out,
                   const std::string& rule, Cancel* cancel) {
    const FillRule fill = rule_named(rule);
    return ask_points<std::uint8_t>(
        scene, points, out, py::dtype::of<bool>(), cancel,
        [&](const Scene& asked, auto where, auto inside, const Flag* cancelled) {
            asked.contains(where, inside, fill, cancelled);
        });
}

py::array closest_points(PyScene& scene, const py::object& points,
                         std::optional<float> max_distance, const py::object& out, Cancel* cancel) {
    const float most = max_distance.value_or(kInfinity);
    return ask_points<ClosestPoint>(
        scene, points, out, closest_dtype(), cancel,
        [&](const Scene& asked, auto where, auto closest, const Flag* cancelled) {
            asked.closest_points(where, closest, most, cancelled);
            // ClosestPoint ends with a byte and three of padding, where closest_dtype() has a
            // number of four bytes: numpy copies no padding, and equal answers have equal bytes.
            static_assert(sizeof(ClosestPoint) == 36 && offsetof(ClosestPoint, feature) == 32);
            static_assert(std::endian::native == std::endian::little);
            for (ClosestPoint& point : closest)
                std::memset(reinterpret_cast<std::byte*>(&point.feature) + 1, 0, 3);
        });
}

py::array signed_distance(PyScene& scene, const py::object& points, const py::object& out,
                          const std::string& rule, std::optional<float> max_distance,
                          Cancel* cancel) {
    const FillRule fill = rule_named(rule);
    const float most = max_distance.value_or(kInfinity);
    return ask_points<float>(
        scene, points, out, py::dtype::of<float>(), cancel,
        [&](const Scene& asked, auto where, auto distances, const Flag* cancelled) {
            asked.signed_distance(where, distances, fill, most, cancelled);
        });
}

}  // namespace

void bind_queries(py::class_<PyScene>& scene_class) {
    const py::none none;
    scene_class
        .def(
            "intersect", &intersect,
            R"(Finds the closest hits. Hits have t > 0 and tnear <= t <= tfar; t is in units of dir.

rays: (N, 8) float32, org, tnear, dir and tfar, or (N,) ray_dtype: read in place if C-contiguous;
      (N, 6) float32, org and dir, with tnear 0 and tfar infinite. More axes in front are kept.
out:  a C-contiguous array of hit_dtype to write to, with one element a ray
coherence: what is known of the rays, for speed alone: "none"; "sort", they come in any order; or the
      width of the image whose rays they are, row by row

Returns an array of hit_dtype, `out` if it is given. The hit is at (1 - u - v) * p0 + u * p1 + v * p2. A
miss has t = inf and the IDs INVALID_ID. At equal t the lowest (geom_id, prim_id) is the hit.

Raises TypeError for another dtype, ValueError for another shape, `out` or coherence.)",
            arg("rays"), arg("out") = none, py::kw_only(), arg("coherence") = "none")
        .def("occluded", &occluded,
             "Finds whether rays hit anything: an array of bool. Arguments are those of "
             "intersect().",
             arg("rays"), arg("out") = none, py::kw_only(), arg("coherence") = "none")
        .def("intersect_all", &intersect_all,
             R"(Finds every hit of rays, as an AllHits; axes in front of the rays are flattened.

crossing: which triangles a ray through an edge or a vertex hits. "once": the first of its mesh there.
          "each": all of them. "owner": one by which it passes through the surface, so that a closed mesh
          is entered as often as it is left; none at a border or where it only touches.
max_hits: the most hits that are listed for a ray, the first ones. None: all
cancel:   a morphray.Cancel, which ends the call with Error "cancelled"

Takes 20 bytes a hit and 16 bytes a ray, twice while the answer is made. Raises Error "limit" if the
memory does not suffice.)",
             arg("rays"), py::kw_only(), arg("crossing") = "once", arg("max_hits") = none,
             arg("cancel") = none)
        .def("count", &count,
             "Counts all hits of rays: an array of int64. Arguments are those of intersect() and "
             "intersect_all().",
             arg("rays"), arg("out") = none, py::kw_only(), arg("crossing") = "once",
             arg("coherence") = "none", arg("cancel") = none)
        .def(
            "winding", &winding,
            R"(Finds how often the meshes wind around points, exactly: 1 inside a closed mesh whose triangles are
counter-clockwise as seen from outside, 0 outside; meshes add up.

points: (N, 3) float32; more axes in front are kept
out:    a C-contiguous array of the result's dtype to write to
cancel: a morphray.Cancel, which ends the call with Error "cancelled"

Returns an array of int32: how often a half-line along +z leaves the meshes, minus how often it
enters them.
A point on the surface has the winding of one of its neighbours, one that is not finite has 0.)",
            arg("points"), arg("out") = none, py::kw_only(), arg("cancel") = none)
        .def("contains", &contains,
             R"(Finds which points are inside, or lie on a triangle, exactly: an array of bool.

rule: which windings are inside, "nonzero", so that overlapping meshes are one, or "odd" numbers of
      crossings, so that where two meshes overlap is outside. Other arguments are those of winding().)",
             arg("points"), arg("out") = none, py::kw_only(), arg("rule") = "nonzero",
             arg("cancel") = none)
        .def(
            "closest_points", &closest_points,
            R"(Finds the closest points of the meshes, not farther than max_distance: an array of closest_dtype.

point is at (1 - u - v) * p0 + u * p1 + v * p2. feature is 0 inside of the triangle, 1 on an edge and 2 at
a corner. Of equally close triangles it is the lowest (geom_id, prim_id). Where there is none, distance is
inf and the IDs are INVALID_ID. Other arguments are those of winding().)",
            arg("points"), arg("max_distance") = none, arg("out") = none, py::kw_only(),
            arg("cancel") = none)
        .def(
            "signed_distance", &signed_distance,
            R"(Finds the distances of points to the meshes, negative inside: an array of float32. Arguments are those
of contains() and closest_points(). NaN for a point that is not finite.)",
            arg("points"), arg("out") = none, py::kw_only(), arg("rule") = "nonzero",
            arg("max_distance") = none, arg("cancel") = none);
}

}  // namespace morphray::python
