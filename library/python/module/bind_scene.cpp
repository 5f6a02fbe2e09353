// morphray.Scene.
#include <pybind11/stl.h>

#include "library/python/module/bindings.h"
#include "library/python/module/scene.h"
#include "library/python/module/scene_docs.h"
#include "morphray/scene.hpp"

namespace morphray::python {
namespace {

using py::arg;

/// One mesh from a tuple (points, triangles[, deforms[, albedo[, textures]]]).
BorrowedMesh mesh_of(const py::handle& item, std::size_t number) {
    const std::string place = "mesh " + std::to_string(number) + ": ";
    if (!py::isinstance<py::tuple>(item) && !py::isinstance<py::list>(item))
        throw py::type_error(place + "a morphray.Mesh or a tuple (points, triangles) is needed");
    const py::tuple parts =
        py::module_::import("morphray").attr("Mesh")(*py::reinterpret_borrow<py::sequence>(item));
    if (!py::isinstance<py::bool_>(parts[2]))
        throw py::type_error(place + "deforms: True or False is needed");
    return borrow(parts[0], parts[1], parts[2].cast<bool>(), parts[3], parts[4], place);
}

std::vector<BorrowedMesh> meshes_of(const py::object& points, const py::object& triangles,
                                    bool deforms, const py::object& albedo,
                                    const py::object& textures) {
    std::vector<BorrowedMesh> meshes;
    if (!triangles.is_none()) {
        meshes.push_back(borrow(points, triangles, deforms, albedo, textures));
        return meshes;
    }
    if (!py::isinstance<py::list>(points) && !py::isinstance<py::tuple>(points)) {
        throw py::type_error(
            "Scene: arrays of points and triangles are needed, or a list of meshes");
    }
    if (!albedo.is_none() || !textures.is_none() || !deforms) {
        throw py::type_error(
            "Scene: deforms, albedo and textures belong into each mesh of the list");
    }
    for (const py::handle item : points) meshes.push_back(mesh_of(item, meshes.size()));
    return meshes;
}

std::unique_ptr<PyScene> make_scene(const py::object& points, const py::object& triangles,
                                    const py::object& device, const py::object& bounds,
                                    const std::string& update, double budget_ms, double budget,
                                    bool deterministic, const std::string& split, bool deforms,
                                    const py::object& albedo, const py::object& refit_on,
                                    bool record_cost_ratio, const py::object& textures) {
    SceneOptions options{.bounds = bounds_of(bounds),
                         .update = policy_of(update, budget_ms, budget, deterministic),
                         .split = split_of(split),
                         .record_cost_ratio = record_cost_ratio};
    std::vector<BorrowedMesh> meshes = meshes_of(points, triangles, deforms, albedo, textures);
    if (!refit_on.is_none()) options.refit_on = device_of(refit_on, "refit_on");
    return std::make_unique<PyScene>(std::move(meshes), device_of(device, "device"), options);
}

Update update(PyScene& scene, const py::object& geom_id, const py::object& first,
              const py::object& count) {
    if (geom_id.is_none()) {
        if (!count.is_none() || uint32_of(first, "first") != 0)
            throw py::type_error("update: a range of points needs the geom_id of their mesh");
        return scene.update(false);
    }
    std::optional<std::size_t> points;
    if (!count.is_none()) points = uint32_of(count, "count");
    return scene.update(uint32_of(geom_id, "geom_id"), uint32_of(first, "first"), points);
}

Image render(PyScene& scene, const py::object& size, const py::object& eye,
             const py::object& target, const py::object& up, double fov, const py::object& light,
             const std::string& rays, const py::object& ao_count, double ao_distance,
             const std::string& shading, const py::object& samples, bool flat,
             const py::object& cancel) {
    if (!py::isinstance<py::sequence>(size) || py::len(size) != 2)
        throw py::type_error("size: a pair of numbers is needed, (width, height)");
    const auto pair = py::reinterpret_borrow<py::sequence>(size);
    View view{.eye = optional_point_of(eye, "eye"),
              .target = optional_point_of(target, "target"),
              .up = point_of(up, "up"),
              .fov = fov,
              .light = optional_point_of(light, "light"),
              .width = uint32_of(py::object(pair[0]), "size[0]"),
              .height = uint32_of(py::object(pair[1]), "size[1]"),
              .rays = rays_named(rays),
              .shading = shading_named(shading),
              .samples = uint32_of(samples, "samples"),
              .flat = flat,
              .ao_count = uint32_of(ao_count, "ao_count"),
              .ao_distance = ao_distance};
    Image image;
    const std::size_t rays_of_image = std::size_t{view.width} * view.height * view.samples;
    scene.query(rays_of_image, cancel_of(cancel),
                [&](const Scene& rendered, const std::atomic<bool>* cancelled) {
                    view.cancel = cancelled;
                    image = rendered.render(view);
                });
    return image;
}

/// A function that returns what a member of Scene returns.
template <class Result>
auto reading(Result (Scene::*member)() const) {
    return [member](PyScene& scene) {
        return scene.read(
            [&](const Scene& s) -> std::remove_cvref_t<Result> { return (s.*member)(); });
    };
}

py::tuple bounds(PyScene& scene) {
    const Box box = scene.read([](const Scene& s) { return s.bounds(); });
    return py::make_tuple(py::array_t<double>(3, box.lower.data()),
                          py::array_t<double>(3, box.upper.data()));
}

void bind_update(py::module_& module) {
    py::class_<Update>(module, "Update",
                       "What Scene.update() did. A part that did not happen takes 0 ms.")
        .def_property_readonly(
            "step", [](const Update& update) { return to_string(update.step); }, kStepDoc)
        .def_readonly("reason", &Update::reason, "Why, as a clause for people.")
        .def_readonly(
            "cost_ratio", &Update::cost_ratio,
            "The cost of the tree relative to that when it was built. 1: it was not asked for.")
        .def_readonly("build_pending", &Update::build_pending,
                      "Whether a tree is being built in the background.")
        .def_property_readonly("milliseconds", &Update::milliseconds, "The sum of all parts.")
        .def_readonly("read_ms", &Update::read_ms, "Reading the arrays of points.")
        .def_readonly("upload_ms", &Update::upload_ms, "Positions and trees to the device.")
        .def_readonly("refit_ms", &Update::refit_ms)
        .def_readonly("decide_ms", &Update::decide_ms, "Finding the cost ratio, and deciding.")
        .def_readonly("restructure_ms", &Update::restructure_ms)
        .def_readonly("rebuild_ms", &Update::rebuild_ms)
        .def("__repr__", [](const Update& update) {
            return std::string("<morphray.Update ") + to_string(update.step) + ": " +
                   update.reason + ">";
        });
    py::class_<EdgeCounts>(module, "EdgeCounts", "Of Scene.edge_counts().")
        .def_readonly("open", &EdgeCounts::open, "Edges of one triangle.")
        .def_readonly("shared", &EdgeCounts::shared, "Edges of more than two triangles.")
        .def_readonly("turned", &EdgeCounts::turned,
                      "Edges that two triangles run through in one direction.")
        .def_readonly("uneven", &EdgeCounts::uneven,
                      "Edges that are run through more often in one direction.")
        .def_property_readonly(
            "is_closed", &EdgeCounts::is_closed,
            "Whether inside, winding and the sign of distances are those of a solid.")
        .def("__repr__", [](const EdgeCounts& edges) {
            return "<morphray.EdgeCounts " + std::to_string(edges.open) + " open, " +
                   std::to_string(edges.shared) + " shared, " + std::to_string(edges.turned) +
                   " turned>";
        });
    py::class_<TreeStatistics>(module, "TreeStatistics", "Of Scene.tree_statistics().")
        .def_readonly("sah_cost", &TreeStatistics::sah_cost,
                      "Expected visits of nodes and tests of triangles of a random ray.")
        .def_readonly("node_count", &TreeStatistics::node_count)
        .def_readonly("leaf_count", &TreeStatistics::leaf_count)
        .def_readonly("depth", &TreeStatistics::depth)
        .def_readonly("bytes", &TreeStatistics::bytes)
        .def_readonly("hash", &TreeStatistics::hash,
                      "XXH3 (64 bits) of nodes and leaves: the same on every device.")
        .def("__repr__", [](const TreeStatistics& tree) {
            return "<morphray.TreeStatistics " + std::to_string(tree.node_count) + " nodes, " +
                   std::to_string(tree.leaf_count) + " leaves>";
        });
}

}  // namespace

void bind_scene(py::module_& module) {
    py::class_<Cancel>(module, "Cancel", kCancelDoc)
        .def(py::init<>(), "__init__(self)\n--\n\nSee the class.")
        .def("set", &Cancel::set,
             "set(self)\n--\n\nEnds all calls that have this Cancel now or later.")
        .def("clear", &Cancel::clear,
             "clear(self)\n--\n\nLets calls that begin from now on run to their end.")
        .def("is_set", &Cancel::is_set,
             "is_set(self)\n--\n\nWhether set() has been called since the last clear().");
    bind_update(module);
    const Auto automatic;
    py::class_<PyScene> scene_class(module, "Scene", kSceneDoc);
    scene_class
        .def(py::init(&make_scene), kInitDoc, arg("points"), arg("triangles") = py::none(),
             py::kw_only(), arg("device") = "cpu", arg("bounds") = py::none(),
             arg("update") = "auto", arg("budget_ms") = automatic.budget_ms,
             arg("budget") = automatic.budget, arg("deterministic") = false,
             arg("split") = "binned", arg("deforms") = true, arg("albedo") = py::none(),
             arg("refit_on") = py::none(), arg("record_cost_ratio") = false,
             arg("textures") = py::none())
        .def("update", &update, kUpdateMethodDoc, arg("geom_id") = py::none(), arg("first") = 0,
             arg("count") = py::none())
        .def(
            "update_with_new_bounds", [](PyScene& scene) { return scene.update(true); },
            kNewBoundsDoc)
        .def(
            "attach",
            [](PyScene& scene, const py::object& points, const py::object& triangles, bool deforms,
               const py::object& albedo, const py::object& textures) {
                return scene.attach(borrow(points, triangles, deforms, albedo, textures));
            },
            kAttachDoc, arg("points"), arg("triangles"), arg("deforms") = true,
            arg("albedo") = py::none(), arg("textures") = py::none())
        .def(
            "detach",
            [](PyScene& scene, const py::object& geom_id) {
                scene.detach(uint32_of(geom_id, "geom_id"));
            },
            "detach(self, geom_id)\n--\n\nRemoves a mesh from the next update() on.",
            arg("geom_id"))
        .def("last_update", reading(&Scene::last_update),
             "last_update(self)\n--\n\nWhat the last build or update() did, as far as it is known "
             "by now.")
        .def("render", &render, kRenderDoc, arg("size") = py::make_tuple(1024, 1024), py::kw_only(),
             arg("eye") = py::none(), arg("target") = py::none(),
             arg("up") = py::make_tuple(0.0, 1.0, 0.0), arg("fov") = View{}.fov,
             arg("light") = py::none(), arg("rays") = "primary", arg("ao_count") = View{}.ao_count,
             arg("ao_distance") = View{}.ao_distance, arg("shading") = "plain",
             arg("samples") = View{}.samples, arg("flat") = View{}.flat, arg("cancel") = py::none())
        .def(
            "on",
            [](PyScene& scene, const py::object& device) {
                return scene.on(device_of(device, "device"));
            },
            "on(self, device)\n--\n\nA scene over the same arrays with a copy of this tree on "
            "another device.",
            arg("device"))
        .def("tree_statistics", reading(&Scene::tree_statistics),
             "tree_statistics(self)\n--\n\nReads the tree back from the device.")
        .def("edge_counts", reading(&Scene::edge_counts),
             "edge_counts(self)\n--\n\nThe edges where the surface is not that of a solid, at the "
             "pose at which this is first called.")
        .def_property_readonly("device", &PyScene::device, "The Device that traces.")
        .def_property_readonly("bounds", &bounds,
                               "(lower, upper), two (3,) float64, of the finite points. lower > "
                               "upper if there are none.")
        .def_property_readonly("triangle_count", reading(&Scene::triangle_count),
                               "Of all meshes together.")
        .def_property_readonly("vertex_count", reading(&Scene::vertex_count),
                               "Of all meshes together.")
        .def("__repr__", [](const PyScene& scene) {
            return "<morphray.Scene on " + scene.device().name() + ">";
        });
    bind_queries(scene_class);
}

}  // namespace morphray::python
