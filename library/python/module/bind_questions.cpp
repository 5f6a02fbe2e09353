// The questions about all triangles of a scene, as methods of morphray.Scene.
#include <pybind11/stl.h>

#include <bit>
#include <cstddef>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>

#include "library/python/module/arrays.h"
#include "library/python/module/bindings.h"
#include "library/python/module/options.h"
#include "library/python/module/query_docs.h"
#include "library/python/module/scene.h"
#include "morphray/queries.hpp"

namespace morphray::python {
namespace {

using py::arg;
using Flag = std::atomic<bool>;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

std::span<const Vec3> points_in(const QueryArray& array) {
    return {reinterpret_cast<const Vec3*>(array.data), array.count};
}

/// Results with one Number a query, which the library writes as numbers of type `Written`. The two
/// differ by a sign at most, or in name: numbers of signed types are what numpy indexes and counts
/// with.
template <class Number, class Written, class Work>
py::array answer(const QueryArray& queries, const py::object& out, Work work) {
    static_assert(sizeof(Number) == sizeof(Written));
    py::array results = results_for(queries, out, py::dtype::of<Number>());
    work(std::span(static_cast<Written*>(results.mutable_data()), queries.count));
    return results;
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

py::object intersect_all(PyScene& scene, const py::object& rays, const std::string& crossing,
                         const py::object& max_hits, const py::object& cancel) {
    AllHitsOptions options{.crossing = crossing_named(crossing)};
    if (!max_hits.is_none()) options.max_hits = uint32_of(max_hits, "max_hits");
    const QueryArray array = rays_of(rays);
    AllHits all;
    scene.ask(array, cancel_of(cancel), [&](const Scene& asked, const Flag* cancelled) {
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
    const QueryArray array = rays_of(rays);
    const Crossing rule = crossing_named(crossing);
    const Coherence known = coherence_of(coherence);
    return answer<std::int64_t, std::uint64_t>(array, out, [&](std::span<std::uint64_t> counts) {
        scene.ask(array, cancel_of(cancel), [&](const Scene& asked, const Flag* cancelled) {
            for_each_batch(array, batch_size(array, known), 0, kInfinity,
                           [&](std::size_t first, std::span<const Ray> batch) {
                               asked.count(batch, counts.subspan(first, batch.size()), rule, known,
                                           cancelled);
                           });
        });
    });
}

py::array winding(PyScene& scene, const py::object& points, const py::object& out,
                  const py::object& cancel) {
    const QueryArray array = query_points_of(points);
    return answer<std::int32_t, std::int32_t>(array, out, [&](std::span<std::int32_t> windings) {
        scene.ask(array, cancel_of(cancel), [&](const Scene& asked, const Flag* cancelled) {
            asked.winding(points_in(array), windings, cancelled);
        });
    });
}

py::array contains(PyScene& scene, const py::object& points, const py::object& out,
                   const std::string& rule, const py::object& cancel) {
    const QueryArray array = query_points_of(points);
    const FillRule fill = rule_named(rule);
    return answer<bool, std::uint8_t>(array, out, [&](std::span<std::uint8_t> inside) {
        scene.ask(array, cancel_of(cancel), [&](const Scene& asked, const Flag* cancelled) {
            asked.contains(points_in(array), inside, fill, cancelled);
        });
    });
}

/// ClosestPoint ends with a byte and three of padding, where closest_dtype() has a number of four
/// bytes: numpy copies no padding, and equal answers have equal bytes.
void widen_features(std::span<ClosestPoint> closest) {
    static_assert(sizeof(ClosestPoint) == 36 && offsetof(ClosestPoint, feature) == 32);
    static_assert(std::endian::native == std::endian::little);
    for (ClosestPoint& point : closest)
        std::memset(reinterpret_cast<std::byte*>(&point.feature) + 1, 0, 3);
}

py::array closest_points(PyScene& scene, const py::object& points,
                         std::optional<float> max_distance, const py::object& out,
                         const py::object& cancel) {
    const QueryArray array = query_points_of(points);
    py::array results = results_for(array, out, closest_dtype());
    const std::span closest(static_cast<ClosestPoint*>(results.mutable_data()), array.count);
    scene.ask(array, cancel_of(cancel), [&](const Scene& asked, const Flag* cancelled) {
        asked.closest_points(points_in(array), closest, max_distance.value_or(kInfinity),
                             cancelled);
    });
    widen_features(closest);
    return results;
}

py::array signed_distance(PyScene& scene, const py::object& points, const py::object& out,
                          const std::string& rule, std::optional<float> max_distance,
                          const py::object& cancel) {
    const QueryArray array = query_points_of(points);
    const FillRule fill = rule_named(rule);
    const float most = max_distance.value_or(kInfinity);
    return answer<float, float>(array, out, [&](std::span<float> distances) {
        scene.ask(array, cancel_of(cancel), [&](const Scene& asked, const Flag* cancelled) {
            asked.signed_distance(points_in(array), distances, fill, most, cancelled);
        });
    });
}

}  // namespace

Cancel* cancel_of(const py::object& cancel) {
    if (cancel.is_none()) return nullptr;
    if (!py::isinstance<Cancel>(cancel))
        throw py::type_error("cancel: a morphray.Cancel or None is needed");
    return &cancel.cast<Cancel&>();
}

void bind_questions(py::class_<PyScene>& scene_class) {
    scene_class
        .def("intersect_all", &intersect_all, kIntersectAllDoc, arg("rays"), py::kw_only(),
             arg("crossing") = "owner", arg("max_hits") = py::none(), arg("cancel") = py::none())
        .def("count", &count, kCountDoc, arg("rays"), arg("out") = py::none(), py::kw_only(),
             arg("crossing") = "owner", arg("coherence") = "none", arg("cancel") = py::none())
        .def("winding", &winding, kWindingDoc, arg("points"), arg("out") = py::none(),
             py::kw_only(), arg("cancel") = py::none())
        .def("contains", &contains, kContainsDoc, arg("points"), arg("out") = py::none(),
             py::kw_only(), arg("rule") = "nonzero", arg("cancel") = py::none())
        .def("closest_points", &closest_points, kClosestPointsDoc, arg("points"),
             arg("max_distance") = py::none(), arg("out") = py::none(), py::kw_only(),
             arg("cancel") = py::none())
        .def("signed_distance", &signed_distance, kSignedDistanceDoc, arg("points"),
             arg("out") = py::none(), py::kw_only(), arg("rule") = "nonzero",
             arg("max_distance") = py::none(), arg("cancel") = py::none());
}

}  // namespace morphray::python
