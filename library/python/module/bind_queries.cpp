// The queries of morphray.Scene about rays and points.
#include <bit>
#include <cassert>
#include <cstring>

#include "library/python/module/scene.h"

namespace morphray::python {
namespace {

using py::arg;
using Flag = std::atomic<bool>;

/// "none", "sort", or the width of an image.
Coherence coherence_of(const py::object& coherence) {
    if (!py::isinstance<py::str>(coherence))
        return Coherence::image(value_of<std::uint32_t>(
            coherence, R"(coherence: "none", "sort" or the width of an image)"));
    const std::string name = py::str(coherence);
    if (name == "none") return Coherence::none();
    if (name == "sort") return Coherence::sort();
    throw_choice("coherence", name, R"("none" and "sort", or the width of an image)");
}

Crossing crossing_named(const py::object& crossing) {
    return choice<Crossing>("crossing", crossing, {"once", "each", "owner"});
}
FillRule rule_named(const py::object& rule) {
    return choice<FillRule>("rule", rule, {"nonzero", "odd"});
}

/// The keywords that all queries have, and the coherence of rays.
struct QueryKeywords {
    const py::object& visible;
    const py::object& excluded;
    Threads threads;
    Cancel* cancel;
    Coherence coherence = {};
};

/// Calls `work(scene, items, options)` with the rays or points of an array.
template <class Item, class Work>
void ask(PyScene& scene, const QueryArray& queries, const QueryKeywords& keywords, Work work) {
    const auto visible = visible_of(keywords.visible);
    const auto excluded = excluded_of(keywords.excluded, queries);
    QueryOptions options{.coherence = keywords.coherence,
                         .threads = keywords.threads,
                         .visible = visible,
                         .excluded = excluded};
    scene.query(queries.count, keywords.cancel, [&](const Scene& asked, const Flag* cancelled) {
        options.cancel = cancelled;
        work(asked, queries.items<Item>(), options);
    });
}

/// What a member of Scene answers. `Written` has the size of the dtype; `more` are arguments
/// between the answers and the options.
template <class Item, class Written, class Query, class... More>
py::array answer(PyScene& scene, const QueryKeywords& keywords, const QueryArray& queries,
                 const py::object& out, const py::dtype& dtype, Query query, const More&... more) {
    py::array array = results_for(queries, out, dtype);
    assert(array.itemsize() == sizeof(Written));
    const std::span results(static_cast<Written*>(array.mutable_data()), queries.count);
    ask<Item>(scene, queries, keywords,
              [&](const Scene& asked, std::span<const Item> items, const QueryOptions& options) {
                  (asked.*query)(items, results, more..., options);
              });
    return array;
}

template <class Element>
py::array owning_array(const py::dtype& dtype, std::vector<Element> elements) {
    auto* const all = new std::vector<Element>(std::move(elements));
    const py::capsule owner(all, [](void* p) { delete static_cast<std::vector<Element>*>(p); });
    return py::array(dtype, static_cast<py::ssize_t>(all->size()), all->data(), owner);
}

/// A member of Scene that is overloaded.
template <class Answer>
using FindFirst = void (Scene::*)(std::span<const Ray>, std::span<Answer>,
                                  const QueryOptions&) const;

template <class Answer, FindFirst<Answer> find>
py::array trace(PyScene& scene, QueryKeywords keywords, const py::object& rays,
                const py::object& out, const py::object& coherence) {
    keywords.coherence = coherence_of(coherence);
    return answer<Ray, Answer>(scene, keywords, rays_of(rays, scene.origin()), out,
                               std::is_same_v<Answer, Hit> ? dtypes().hit : py::dtype::of<bool>(),
                               find);
}

py::object intersect_all(PyScene& scene, QueryKeywords keywords, const py::object& rays,
                         const py::object& crossing, const py::object& max_hits) {
    AllHitsOptions all_options{.crossing = crossing_named(crossing)};
    if (!max_hits.is_none())
        all_options.max_hits = value_of<std::uint32_t>(max_hits, "max_hits: a count below 2^32");
    AllHits all;
    ask<Ray>(scene, rays_of(rays, scene.origin()), keywords,
             [&](const Scene& asked, auto batch, const QueryOptions& options) {
                 all = asked.intersect_all(batch, all_options, options);
             });
    const py::dtype numbers = py::dtype::of<std::int64_t>();
    py::array offsets = owning_array(numbers, std::move(all.offsets));
    py::array hits = owning_array(dtypes().hit, std::move(all.hits));
    py::array left_out = owning_array(numbers, std::move(all.left_out));
    return py::module_::import("morphray").attr("AllHits")(offsets, hits, left_out);
}

py::array count(PyScene& scene, QueryKeywords keywords, const py::object& rays,
                const py::object& out, const py::object& crossing, const py::object& coherence) {
    const Crossing rule = crossing_named(crossing);
    keywords.coherence = coherence_of(coherence);
    return answer<Ray, std::uint64_t>(scene, keywords, rays_of(rays, scene.origin()), out,
                                      py::dtype::of<std::int64_t>(), &Scene::count, rule);
}

py::array normals(PyScene& scene, const py::object& hits, const py::object& smooth) {
    const QueryArray array = hit_array_of(hits);
    const bool is_smooth = value_of<bool>(smooth, "smooth: True or False");
    std::vector<py::ssize_t> shape = array.shape;
    shape.push_back(3);
    py::array_t<float> normals(shape);
    const std::span results(reinterpret_cast<Vec3*>(normals.mutable_data()), array.count);
    scene.query(array.count, nullptr, [&](const Scene& asked, const Flag*) {
        asked.normals(array.items<Hit>(), results, is_smooth);
    });
    return normals;
}

py::array winding(PyScene& scene, QueryKeywords keywords, const py::object& points,
                  const py::object& out) {
    scene.warn_if_open(FillRule::nonzero);
    return answer<Vec3, std::int32_t>(scene, keywords, query_points_of(points, scene.origin()), out,
                                      py::dtype::of<std::int32_t>(), &Scene::winding);
}

py::array contains(PyScene& scene, QueryKeywords keywords, const py::object& points,
                   const py::object& out, const py::object& rule) {
    const FillRule fill = rule_named(rule);
    scene.warn_if_open(fill);
    return answer<Vec3, std::uint8_t>(scene, keywords, query_points_of(points, scene.origin()), out,
                                      py::dtype::of<bool>(), &Scene::contains, fill);
}

float distance_of(const py::object& most) {
    return value_of<std::optional<float>>(most, "max_distance: a number, or None,")
        .value_or(std::numeric_limits<float>::infinity());
}

/// Closest points in the caller's coordinates, which are float64.
py::array from_world(const py::array& closest, const Point& origin, const py::object& out) {
    const QueryArray queries{.name = "points",
                             .shape = {closest.shape(), closest.shape() + closest.ndim()}};
    py::array result = results_for(queries, out, dtypes().far_closest);
    for (const py::handle name : closest.dtype().attr("names")) result[name] = closest[name];
    const py::module_ numpy = py::module_::import("numpy");
    const py::object is_found = numpy.attr("not_equal")(closest["prim_id"], kNoPrim);
    numpy.attr("add")(result["point"], py::array_t<double>(3, origin.data()),
                      arg("out") = result["point"],
                      arg("where") = numpy.attr("expand_dims")(is_found, -1));
    return result;
}

py::array closest_points(PyScene& scene, QueryKeywords keywords, const py::object& points,
                         const py::object& max_distance, const py::object& out) {
    const float most = distance_of(max_distance);
    const Point& origin = scene.origin();
    const bool is_far = origin != Point{};
    py::array found = answer<Vec3, ClosestPoint>(scene, keywords, query_points_of(points, origin),
                                                 is_far ? py::none() : out, dtypes().closest,
                                                 &Scene::closest_points, most);
    // dtypes().closest ends in four bytes, not one and padding: equal answers, equal bytes.
    static_assert(sizeof(ClosestPoint) == 36 && offsetof(ClosestPoint, feature) == 32);
    static_assert(std::endian::native == std::endian::little);
    for (ClosestPoint& point : std::span(static_cast<ClosestPoint*>(found.mutable_data()),
                                         static_cast<std::size_t>(found.size())))
        std::memset(reinterpret_cast<std::byte*>(&point.feature) + 1, 0, 3);
    return is_far ? from_world(found, origin, out) : found;
}

py::array signed_distance(PyScene& scene, QueryKeywords keywords, const py::object& points,
                          const py::object& out, const py::object& rule,
                          const py::object& max_distance) {
    const FillRule fill = rule_named(rule);
    const float most = distance_of(max_distance);
    scene.warn_if_open(fill);
    return answer<Vec3, float>(scene, keywords, query_points_of(points, scene.origin()), out,
                               py::dtype::of<float>(), &Scene::signed_distance, fill, most);
}

/// What a member of Scene answers about the meshes that are named.
template <class Answer>
Answer ask_crossings(PyScene& scene, const py::object& geom_ids, const py::object& other,
                     std::uint64_t limit, const py::object& visible, const py::object& threads,
                     Cancel* cancel,
                     Answer (Scene::*query)(const CrossingOptions&, const QueryOptions&) const) {
    const auto first = geom_ids_of(geom_ids, "geom_ids");
    const auto second = geom_ids_of(other, "other");
    const auto flags = visible_of(visible);
    QueryOptions options{.threads = choice<Threads>("threads", threads, {"all", "calling"}),
                         .visible = flags};
    Answer answer{};
    scene.query(0, cancel, [&](const Scene& asked, const Flag* cancelled) {
        options.cancel = cancelled;
        answer = (asked.*query)({first, second, limit}, options);
    });
    return answer;
}

py::object crossings(PyScene& scene, const py::object& geom_ids, const py::object& other,
                     const py::object& limit, bool count, const py::object& visible,
                     const py::object& threads, Cancel* cancel) {
    const auto most = value_of<std::optional<std::uint64_t>>(limit, "limit: a count, or None,");
    const std::uint64_t listed = count ? 0 : most.value_or(CrossingOptions().limit);
    const Crossings found =
        ask_crossings(scene, geom_ids, other, listed, visible, threads, cancel, &Scene::crossings);
    if (count) return py::int_(found.left_out);
    py::array_t<std::uint32_t> pairs(
        std::vector<py::ssize_t>{static_cast<py::ssize_t>(found.pairs.size()), 2, 2});
    std::uint32_t* to = pairs.mutable_data();
    for (const auto& [first, second] : found.pairs)
        for (const Primitive& triangle : {first, second}) {
            *to++ = triangle.geom_id;
            *to++ = triangle.prim_id;
        }
    return py::module_::import("morphray").attr("Crossings")(pairs, found.left_out);
}

bool has_crossings(PyScene& scene, const py::object& geom_ids, const py::object& other,
                   const py::object& visible, const py::object& threads, Cancel* cancel) {
    return ask_crossings(scene, geom_ids, other, 0, visible, threads, cancel,
                         &Scene::has_crossings);
}

/// Binds a query, which takes QueryKeywords and arguments with these names.
template <class Answer, class... Arguments, class... Names>
void def_query(py::class_<PyScene>& scene_class, const char* name,
               Answer (*query)(PyScene&, QueryKeywords, Arguments...), const char* doc,
               const Names&... names) {
    const py::none none;
    scene_class.def(
        name,
        [query](PyScene& scene, Arguments... arguments, const py::object& visible,
                const py::object& excluded, const py::object& threads, Cancel* cancel) {
            const auto named = choice<Threads>("threads", threads, {"all", "calling"});
            return query(scene, {visible, excluded, named, cancel}, arguments...);
        },
        doc, names..., arg("visible") = none, arg("excluded") = none, arg("threads") = "all",
        arg("cancel") = none);
}

}  // namespace

void bind_queries(py::class_<PyScene>& scene_class) {
    const py::none none;
    const py::kw_only kw_only;
    def_query(
        scene_class, "intersect", &trace<Hit, &Scene::intersect>,
        R"(Finds the closest hits. Hits have t > 0 and tnear <= t <= tfar; t is in units of dir.

rays: (N, 8) numbers, org, tnear, dir and tfar, or (N,) ray_dtype: read in place if float32 and
      C-contiguous; (N, 6) numbers, org and dir, with tnear 0 and tfar infinite. Arrays, lists, or what
      has __dlpack__ on the CPU. Any axes may be in front, or none for one ray.
out:  a C-contiguous array of hit_dtype to write to, with one element a ray
coherence: for speed alone: "none"; "sort" for rays in any order; or the width of the image whose rays
      they are, row by row
visible: (G,) bool, one for each geom_id up to the highest: the meshes that exist for the call. None: all
excluded: (N,) hit_dtype or closest_dtype, or (N, 2) integers, geom_id and prim_id: for each ray a triangle
      that it leaves out, such as that on which it starts; with a prim_id of -1 all of the mesh, such as the
      body that carries a sensor; two times -1, as a miss has: nothing. None: none
threads: "all" of the device, or that which is "calling"
cancel: a morphray.Cancel, which ends the call with Error "cancelled"

Returns an array of hit_dtype, `out` if it is given. The hit is at (1 - u - v) * p0 + u * p1 + v * p2. A
miss has t = inf and the IDs INVALID_ID. At equal t the lowest (geom_id, prim_id) is the hit.
Raises TypeError for another dtype, ValueError for another shape, `out` or coherence.)",
        arg("rays"), arg("out") = none, kw_only, arg("coherence") = "none");
    def_query(scene_class, "occluded", &trace<std::uint8_t, &Scene::occluded>,
              "Finds whether rays hit anything: an array of bool. Arguments as for intersect().",
              arg("rays"), arg("out") = none, kw_only, arg("coherence") = "none");
    def_query(scene_class, "intersect_all", &intersect_all,
              R"(Finds every hit of rays, as an AllHits; axes in front of the rays are flattened.

crossing: at an edge or a vertex, "once": the first triangle of its mesh there; "each": all of them;
          "owner": one by which a ray passes through the surface, so that a closed mesh is entered as
          often as it is left; none at a border or where it only touches.
max_hits: the most hits that are listed for a ray, the first ones. None: all
visible, excluded, threads, cancel: those of intersect()

Takes 20 bytes a hit and 16 bytes a ray, twice while the answer is made. Raises Error "limit" if the
memory does not suffice.)",
              arg("rays"), kw_only, arg("crossing") = "once", arg("max_hits") = none);
    def_query(scene_class, "count", &count,
              "Counts all hits of rays: int64. Arguments as for intersect() and intersect_all().",
              arg("rays"), arg("out") = none, kw_only, arg("crossing") = "once",
              arg("coherence") = "none");
    scene_class.def(
        "normals", &normals,
        R"(Finds the unit normals of hits, or of closest points: (N, 3) float32; 0 for a miss.

Corners are counter-clockwise as seen from where the normal points.

hits:   an array of hit_dtype or closest_dtype; more axes in front are kept
smooth: interpolate the normals of the corners, as lit images do: means of the normals of their triangles,
        weighted by the angles there; a corner more than 37 degrees off the triangle's own takes that)",
        arg("hits"), arg("smooth") = false);
    def_query(
        scene_class, "winding", &winding,
        R"(Finds how often the meshes wind around points, exactly: 1 inside a closed mesh whose triangles are
counter-clockwise as seen from outside, 0 outside; meshes add up.

points: (N, 3) numbers, read in place if float32 and C-contiguous, as rays; or one point
out:    a C-contiguous array of the result's dtype to write to
visible, excluded, threads, cancel: those of intersect(), with a triangle or mesh for each point that it
      leaves out. A mesh that loses a triangle is open.

Returns an array of int32: how often a half-line along +z leaves the meshes, minus how often it enters
them. A point on the surface has the winding of one of its neighbours, one that is not finite has 0.)",
        arg("points"), arg("out") = none, kw_only);
    def_query(scene_class, "contains", &contains,
              R"(Finds which points are inside, or lie on a triangle, exactly: an array of bool.

rule: "nonzero" windings are inside, so that overlapping meshes are one, or "odd" numbers of crossings,
      so that where two meshes overlap is outside. Other arguments are those of winding().)",
              arg("points"), arg("out") = none, kw_only, arg("rule") = "nonzero");
    def_query(
        scene_class, "closest_points", &closest_points,
        R"(Finds the closest points of the meshes, not farther than max_distance: an array of closest_dtype.

point is at (1 - u - v) * p0 + u * p1 + v * p2. feature is 0 inside of the triangle, 1 on an edge and 2 at
a corner. Of equally close triangles it is the lowest (geom_id, prim_id). Where there is none, distance is
inf and the IDs are INVALID_ID. Other arguments are those of winding(). Where Scene.origin is not 0, the
point is float64.)",
        arg("points"), arg("max_distance") = none, arg("out") = none, kw_only);
    def_query(
        scene_class, "signed_distance", &signed_distance,
        R"(Finds the distances of points to the meshes, negative inside: an array of float32. Arguments are those
of contains() and closest_points(). NaN for a point that is not finite.)",
        arg("points"), arg("out") = none, kw_only, arg("rule") = "nonzero",
        arg("max_distance") = none);
    scene_class.def(
        "crossings", &crossings,
        R"(Finds the pairs of triangles that cross, exactly: that have a point in common which lies on no vertex
and no edge that both have by position. Equal triangles cross.

geom_ids: the meshes whose triangles form pairs. None: all
other:  pairs have one triangle of geom_ids and one of these meshes. None: both are of geom_ids
limit:  the most pairs that are listed, the first ones. None: all
count:  return only their number, an int
visible, threads, cancel: those of intersect()

Returns a Crossings. Raises Error "bad_argument" for a geom_id that no mesh has.)",
        arg("geom_ids") = none, arg("other") = none, kw_only, arg("limit") = none,
        arg("count") = false, arg("visible") = none, arg("threads") = "all", arg("cancel") = none);
    scene_class.def("has_crossings", &has_crossings,
                    "Finds whether any triangles cross: a bool. Arguments as for crossings().",
                    arg("geom_ids") = none, arg("other") = none, kw_only, arg("visible") = none,
                    arg("threads") = "all", arg("cancel") = none);
}

}  // namespace morphray::python
