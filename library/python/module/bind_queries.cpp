// The queries of morphray.Scene about rays and points.
#include <pybind11/stl.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>

#include "library/python/module/bindings.h"
#include "library/python/module/scene.h"
#include "library/python/module/scene_docs.h"
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

/// Calls `work(scene, rays, results, cancelled)` for batches of rays. Those of six numbers have
/// these limits.
template <class Written, class Work>
py::array ask_rays(PyScene& scene, const QueryArray& rays, float tnear, float tfar,
                   Coherence coherence, const py::object& out, const py::dtype& dtype,
                   Cancel* cancel, Work work) {
    return answer<Written>(rays, out, dtype, [&](std::span<Written> results) {
        scene.query(rays.count, cancel, [&](const Scene& asked, const Flag* cancelled) {
            for_each_batch(rays, batch_size(rays, coherence), tnear, tfar,
                           [&](std::size_t first, std::span<const Ray> batch) {
                               work(asked, batch, results.subspan(first, batch.size()), cancelled);
                           });
        });
    });
}

/// Calls `work(scene, points, results, cancelled)`.
template <class Written, class Work>
py::array ask_points(PyScene& scene, const py::object& points, const py::object& out,
                     const py::dtype& dtype, const py::object& cancel, Work work) {
    const QueryArray array = query_points_of(points);
    const std::span where(reinterpret_cast<const Vec3*>(array.data), array.count);
    return answer<Written>(array, out, dtype, [&](std::span<Written> results) {
        scene.query(array.count, cancel_of(cancel), [&](const Scene& asked, const Flag* cancelled) {
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
                    const py::object& coherence) {
    const Coherence known = coherence_of(coherence);
    return ask_rays<Hit>(
        scene, rays_of(rays), 0, kInfinity, known, out, hit_dtype(), nullptr,
        [&](const Scene& asked, auto batch, std::span<Hit> hits, const Flag* cancelled) {
            asked.intersect(batch, hits, known, cancelled);
        });
}

py::array occluded_in(PyScene& scene, const QueryArray& rays, float tnear, float tfar,
                      const py::object& out, const py::object& coherence) {
    const Coherence known = coherence_of(coherence);
    return ask_rays<std::uint8_t>(
        scene, rays, tnear, tfar, known, out, py::dtype::of<bool>(), nullptr,
        [&](const Scene& asked, auto batch, std::span<std::uint8_t> results,
            const Flag* cancelled) { asked.occluded(batch, results, known, cancelled); });
}

py::array occluded(PyScene& scene, const py::object& rays, const py::object& out,
                   const py::object& coherence) {
    return occluded_in(scene, rays_of(rays), 0, kInfinity, out, coherence);
}

py::array test_occlusions(PyScene& scene, const py::object& rays, float tnear,
                          std::optional<float> tfar, const py::object& coherence) {
    const QueryArray array = rays_of(rays);
    if (array.columns == 8 && (tnear != 0 || tfar)) {
        throw py::value_error(
            "test_occlusions: tnear and tfar are for rays of six numbers; these have their own");
    }
    return occluded_in(scene, array, tnear, tfar.value_or(kInfinity), py::none(), coherence);
}

/// The corners of a mesh's triangles, which normals are made of.
struct Corners {
    Positions positions;
    std::span<const std::uint32_t> triangles;

    Vec3 point(std::uint32_t vertex) const {
        Vec3 p;
        std::memcpy(&p, static_cast<const std::byte*>(positions.data) + vertex * positions.stride,
                    sizeof(p));
        return p;
    }
};

/// Writes a normal of length 1, or of length 0 for a triangle without area. Computes in doubles,
/// where products of floats do not overflow.
void write_normal(const Corners& mesh, std::uint32_t prim_id, float* out) {
    const std::uint32_t* const corner = &mesh.triangles[std::size_t{3} * prim_id];
    const Vec3 p0 = mesh.point(corner[0]);
    const Vec3 p1 = mesh.point(corner[1]);
    const Vec3 p2 = mesh.point(corner[2]);
    const double a[] = {double{p1.x} - p0.x, double{p1.y} - p0.y, double{p1.z} - p0.z};
    const double b[] = {double{p2.x} - p0.x, double{p2.y} - p0.y, double{p2.z} - p0.z};
    const double n[] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                        a[0] * b[1] - a[1] * b[0]};
    const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    // Positions may have become NaN or infinite since the last update.
    const bool has_area = length > 0 && std::isfinite(length);
    for (int axis = 0; axis < 3; ++axis)
        out[axis] = has_area ? static_cast<float>(n[axis] / length) : 0.0f;
}

py::dict cast_rays(PyScene& scene, const py::object& rays, const py::object& coherence) {
    const QueryArray array = rays_of(rays);
    const Coherence known = coherence_of(coherence);
    const auto with_axis = [&](py::ssize_t size) {
        std::vector<py::ssize_t> shape = array.shape;
        shape.push_back(size);
        return shape;
    };
    py::array_t<float> t_hit(array.shape);
    py::array_t<std::uint32_t> geometry_ids(array.shape);
    py::array_t<std::uint32_t> primitive_ids(array.shape);
    py::array_t<float> uvs(with_axis(2));
    py::array_t<float> normals(with_axis(3));
    float* const t = t_hit.mutable_data();
    std::uint32_t* const geom_id = geometry_ids.mutable_data();
    std::uint32_t* const prim_id = primitive_ids.mutable_data();
    float* const uv = uvs.mutable_data();
    float* const normal = normals.mutable_data();
    scene.query(array.count, nullptr, [&](const Scene& asked, const Flag* cancelled) {
        // By geom_id.
        std::vector<Corners> meshes;
        for (const auto& [id, mesh] : scene.meshes()) {
            meshes.resize(std::size_t{id} + 1);
            meshes[id] = {mesh.positions, *mesh.triangles};
        }
        std::vector<Hit> hits;
        const auto trace = [&](std::size_t first, std::span<const Ray> batch) {
            hits.resize(batch.size());
            asked.intersect(batch, std::span<Hit>(hits), known, cancelled);
            for (std::size_t i = 0; i < hits.size(); ++i) {
                const Hit& hit = hits[i];
                const std::size_t at = first + i;
                t[at] = hit.t;
                geom_id[at] = hit.geom_id;
                prim_id[at] = hit.prim_id;
                uv[2 * at] = hit.u;
                uv[2 * at + 1] = hit.v;
                if (hit) {
                    write_normal(meshes[hit.geom_id], hit.prim_id, normal + 3 * at);
                } else {
                    std::fill_n(normal + 3 * at, 3, 0.0f);
                }
            }
        };
        for_each_batch(array, converted_size(known), 0, kInfinity, trace);
    });
    py::dict result;
    result["t_hit"] = t_hit;
    result["geometry_ids"] = geometry_ids;
    result["primitive_ids"] = primitive_ids;
    result["primitive_uvs"] = uvs;
    result["primitive_normals"] = normals;
    return result;
}

py::object intersect_all(PyScene& scene, const py::object& rays, const std::string& crossing,
                         const py::object& max_hits, const py::object& cancel) {
    AllHitsOptions options{.crossing = crossing_named(crossing)};
    if (!max_hits.is_none()) options.max_hits = uint32_of(max_hits, "max_hits");
    const QueryArray array = rays_of(rays);
    AllHits all;
    scene.query(array.count, cancel_of(cancel), [&](const Scene& asked, const Flag* cancelled) {
        options.cancel = cancelled;
        // One batch: the answer takes as much memory as converted rays.
        for_each_batch(array, std::max<std::size_t>(array.count, 1), 0, kInfinity,
                       [&](std::size_t, std::span<const Ray> batch) {
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
                const std::string& crossing, const py::object& coherence,
                const py::object& cancel) {
    const Crossing rule = crossing_named(crossing);
    const Coherence known = coherence_of(coherence);
    return ask_rays<std::uint64_t>(
        scene, rays_of(rays), 0, kInfinity, known, out, py::dtype::of<std::int64_t>(),
        cancel_of(cancel),
        [&](const Scene& asked, auto batch, std::span<std::uint64_t> counts,
            const Flag* cancelled) { asked.count(batch, counts, rule, known, cancelled); });
}

py::array winding(PyScene& scene, const py::object& points, const py::object& out,
                  const py::object& cancel) {
    return ask_points<std::int32_t>(
        scene, points, out, py::dtype::of<std::int32_t>(), cancel,
        [](const Scene& asked, auto where, auto windings, const Flag* cancelled) {
            asked.winding(where, windings, cancelled);
        });
}

py::array contains(PyScene& scene, const py::object& points, const py::object& out,
                   const std::string& rule, const py::object& cancel) {
    const FillRule fill = rule_named(rule);
    return ask_points<std::uint8_t>(
        scene, points, out, py::dtype::of<bool>(), cancel,
        [&](const Scene& asked, auto where, auto inside, const Flag* cancelled) {
            asked.contains(where, inside, fill, cancelled);
        });
}

py::array closest_points(PyScene& scene, const py::object& points,
                         std::optional<float> max_distance, const py::object& out,
                         const py::object& cancel) {
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
                          const py::object& cancel) {
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
        .def("intersect", &intersect, kIntersectDoc, arg("rays"), arg("out") = none, py::kw_only(),
             arg("coherence") = "none")
        .def("occluded", &occluded, kOccludedDoc, arg("rays"), arg("out") = none, py::kw_only(),
             arg("coherence") = "none")
        .def("cast_rays", &cast_rays, kCastRaysDoc, arg("rays"), py::kw_only(),
             arg("coherence") = "none")
        .def("test_occlusions", &test_occlusions, kTestOcclusionsDoc, arg("rays"),
             arg("tnear") = 0.0f, arg("tfar") = none, py::kw_only(), arg("coherence") = "none")
        .def("intersect_all", &intersect_all, kIntersectAllDoc, arg("rays"), py::kw_only(),
             arg("crossing") = "once", arg("max_hits") = none, arg("cancel") = none)
        .def("count", &count, kCountDoc, arg("rays"), arg("out") = none, py::kw_only(),
             arg("crossing") = "once", arg("coherence") = "none", arg("cancel") = none)
        .def("winding", &winding, kWindingDoc, arg("points"), arg("out") = none, py::kw_only(),
             arg("cancel") = none)
        .def("contains", &contains, kContainsDoc, arg("points"), arg("out") = none, py::kw_only(),
             arg("rule") = "nonzero", arg("cancel") = none)
        .def("closest_points", &closest_points, kClosestPointsDoc, arg("points"),
             arg("max_distance") = none, arg("out") = none, py::kw_only(), arg("cancel") = none)
        .def("signed_distance", &signed_distance, kSignedDistanceDoc, arg("points"),
             arg("out") = none, py::kw_only(), arg("rule") = "nonzero", arg("max_distance") = none,
             arg("cancel") = none);
}

}  // namespace morphray::python
