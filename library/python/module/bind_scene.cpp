// morphray.Scene, Image and compare().
#include <fmt/format.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <filesystem>

#include "library/python/module/scene.h"

namespace morphray::python {
namespace {

using py::arg;

/// One mesh from a tuple (points, triangles[, deforms[, albedo[, textures]]]).
BorrowedMesh mesh_of(const py::handle& item, std::size_t number) {
    const std::string place = fmt::format("mesh {}: ", number);
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
    if (!py::isinstance<py::list>(points) && !py::isinstance<py::tuple>(points))
        throw py::type_error(
            "Scene: arrays of points and triangles are needed, or a list of meshes");
    if (!albedo.is_none() || !textures.is_none() || !deforms)
        throw py::type_error(
            "Scene: deforms, albedo and textures belong into each mesh of the list");
    for (const py::handle item : points) meshes.push_back(mesh_of(item, meshes.size()));
    return meshes;
}

/// A Device, or "cpu", "vulkan" or "brute".
Device device_of(const py::object& device) {
    if (py::isinstance<Device>(device)) return device.cast<Device>();
    const std::string text = py::str(device);
    const GilRelease release;
    if (text == "cpu") return Device::cpu();
    if (text == "vulkan") return Device::vulkan();
    if (text == "brute") return Device::brute_force();
    throw_choice("device", text,
                 R"("cpu", "vulkan" and "brute"; Device.vulkan() takes the name of a device)");
}

UpdatePolicy policy_of(const std::string& update, double budget_ms, double budget,
                       bool deterministic) {
    UpdatePolicy policy;
    try {
        policy = parse_update_policy(update);
    } catch (const Error& error) {
        throw py::value_error(std::string("update: ") + error.what());
    }
    const Auto automatic{budget_ms, budget, deterministic};
    if (std::holds_alternative<Auto>(policy)) return automatic;
    const Auto defaults;
    if (budget_ms != defaults.budget_ms || budget != defaults.budget || deterministic)
        throw py::value_error("update: \"" + update +
                              "\" takes no budget_ms, budget or deterministic; \"auto\" does");
    return policy;
}

std::unique_ptr<PyScene> make_scene(const py::object& points, const py::object& triangles,
                                    const py::object& device, const py::object& bounds,
                                    const std::string& update, double budget_ms, double budget,
                                    bool deterministic, bool deforms, const py::object& albedo,
                                    bool record_cost_ratio, const py::object& textures,
                                    const std::optional<Point>& origin) {
    SceneOptions options{.update = policy_of(update, budget_ms, budget, deterministic),
                         .record_cost_ratio = record_cost_ratio};
    using Corners = std::optional<std::pair<Point, Point>>;
    const auto corners = value_of<Corners>(bounds, "bounds: two points, or None,");
    if (corners) options.bounds = Box{corners->first, corners->second};
    const std::vector<BorrowedMesh> meshes =
        meshes_of(points, triangles, deforms, albedo, textures);
    return std::make_unique<PyScene>(meshes, device_of(device), options, origin);
}

Update update(PyScene& scene, std::optional<std::uint32_t> geom_id, std::uint32_t first,
              std::optional<std::uint32_t> count) {
    if (geom_id) return scene.update(*geom_id, first, count);
    if (count || first != 0)
        throw py::type_error("update: a range of points needs the geom_id of their mesh");
    return scene.update(false);
}

Image render(PyScene& scene, const py::object& size, const py::object& eye,
             const py::object& target, const py::object& up, const py::object& fov,
             const py::object& light, const py::object& rays, std::uint32_t ao_count,
             double ao_distance, const py::object& shading, std::uint32_t samples, bool flat,
             Cancel* cancel) {
    using MaybePoint = std::optional<Point>;
    const auto [width, height] = value_of<std::pair<std::uint32_t, std::uint32_t>>(
        size, "size: two whole numbers (width, height)");
    View view{
        .eye = value_of<MaybePoint>(eye, "eye: three numbers, or None,"),
        .target = value_of<MaybePoint>(target, "target: three numbers, or None,"),
        .up = value_of<Point>(up, "up: three numbers"),
        .fov = value_of<double>(fov, "fov: a number of degrees"),
        .light = value_of<MaybePoint>(light, "light: three numbers, or None,"),
        .width = width,
        .height = height,
        .rays = choice<Rays>("rays", rays, {"primary", "shadow", "ao"}),
        .shading = choice<Shading>("shading", shading, {"plain", "lit", "normal", "depth", "prim"}),
        .samples = samples,
        .flat = flat,
        .ao_count = ao_count,
        .ao_distance = ao_distance};
    Image image;
    const std::size_t rays_of_image = std::size_t{view.width} * view.height * view.samples;
    scene.query(rays_of_image, cancel,
                [&](const Scene& rendered, const std::atomic<bool>* cancelled) {
                    view.cancel = cancelled;
                    image = rendered.render(view);
                });
    return image;
}

/// A row of `cameras` has to_world, fx, fy, cx and cy of a Pinhole, or eye, target and up. `arrays`
/// has one for each channel, of the right size (morphray/_views.py).
void render_views(PyScene& scene, const py::array_t<double, py::array::c_style>& cameras,
                  double fov, const std::pair<std::uint32_t, std::uint32_t>& size,
                  const py::dict& arrays, Cancel* cancel) {
    if (cameras.size() == 0) return;
    std::vector<View> views;
    for (py::ssize_t i = 0; i < cameras.shape(0); ++i) {
        View& view =
            views.emplace_back(View{.fov = fov, .width = size.first, .height = size.second});
        const double* const row = cameras.data(i);
        if (cameras.shape(1) == 9) {
            view.eye = {row[0], row[1], row[2]};
            view.target = {row[3], row[4], row[5]};
            view.up = {row[6], row[7], row[8]};
        } else {
            view.pinhole = {{}, row[12], row[13], row[14], row[15]};
            std::copy_n(row, 12, view.pinhole->to_world.front().data());
        }
    }
    const std::size_t pixels = views.size() * size.first * size.second;
    ImageStack stack;
    const auto set = [&](const char* name, auto& channel) {
        using Element = typename std::remove_reference_t<decltype(channel)>::element_type;
        if (!arrays.contains(name)) return;
        py::array array = arrays[name];
        channel = {static_cast<Element*>(array.mutable_data()), pixels};
    };
    set("depth", stack.depth);
    set("distance", stack.distance);
    set("geom_id", stack.geom_id);
    set("prim_id", stack.prim_id);
    set("normal", stack.normal);
    set("uv", stack.uv);
    set("shaded", stack.shaded);
    scene.query(pixels, cancel, [&](const Scene& rendered, const std::atomic<bool>* cancelled) {
        views.front().cancel = cancelled;
        rendered.render(views, stack);
    });
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

py::array view(const py::dtype& dtype, const std::vector<py::ssize_t>& shape, const void* data,
               const py::object& owner) {
    py::array array(dtype, shape, data, owner);
    array.attr("setflags")(arg("write") = false);
    return array;
}

py::array pixels_of(const py::object& self) {
    const auto& image = self.cast<const Image&>();
    return view(py::dtype::of<std::uint8_t>(), {image.height, image.width, 4}, image.pixels.data(),
                self);
}

/// A view of one element for each camera ray.
template <class Element>
py::array samples_of(const py::object& self, const py::dtype& dtype,
                     const std::vector<Element> Image::*member) {
    const auto& image = self.cast<const Image&>();
    const py::ssize_t side = sample_side(image.samples);
    return view(dtype, {side * image.height, side * image.width}, (image.*member).data(), self);
}
Comparison compare_any(const py::object& first, const py::object& second, const py::object& rays,
                       std::size_t keep) {
    if (py::isinstance<PyScene>(first) && py::isinstance<PyScene>(second)) {
        if (rays.is_none()) throw py::type_error("compare: two scenes need rays to compare");
        auto& a = first.cast<PyScene&>();
        auto& b = second.cast<PyScene&>();
        const QueryArray array = rays_of(rays, a.origin());
        Comparison result;
        a.query(array.count, nullptr, [&](const Scene& scene, const std::atomic<bool>* cancelled) {
            std::shared_lock<std::shared_mutex> lock;
            if (&a != &b) lock = b.query_lock();
            result = compare(scene, b.scene(), array.items<Ray>(), keep, {.cancel = cancelled});
        });
        return result;
    }
    if (py::isinstance<Image>(first) && py::isinstance<Image>(second)) {
        if (!rays.is_none()) throw py::type_error("compare: two images take no rays");
        const auto& a = first.cast<const Image&>();
        const auto& b = second.cast<const Image&>();
        const GilRelease release;
        return compare(a, b, keep);
    }
    throw py::type_error("compare: two scenes or two images are needed");
}

py::array differences_of(const Comparison& comparison) {
    const std::vector<std::pair<const char*, py::dtype>> fields = {
        {"index", py::dtype::of<std::uint64_t>()},
        {"first", dtypes().hit},
        {"second", dtypes().hit}};
    py::array array(py::dtype::from_args(py::cast(fields)),
                    static_cast<py::ssize_t>(comparison.differences.size()));
    static_assert(sizeof(HitDifference) == 48 && offsetof(HitDifference, second) == 28);
    std::ranges::copy(comparison.differences, static_cast<HitDifference*>(array.mutable_data()));
    return array;
}

void bind_images(py::module_& module) {
    py::class_<Image>(module, "Image",
                      R"(An image of Scene.render() with the hits that it was made from.

The arrays are read-only views, row by row from the top; they keep the image alive. They can be
pickled, the image cannot.)")
        .def_readonly("width", &Image::width, "In pixels.")
        .def_readonly("height", &Image::height, "In pixels.")
        .def_readonly("samples", &Image::samples, "Camera rays a pixel.")
        .def_property_readonly("pixels", &pixels_of,
                               "(height, width, 4) uint8: red, green, blue, alpha, in sRGB.")
        .def_property_readonly(
            "hits",
            [](const py::object& self) { return samples_of(self, dtypes().hit, &Image::hits); },
            R"((height, width) of hit_dtype: the hit of each camera ray.

t is the depth along the viewing direction. Several samples a pixel are a square of elements.)")
        .def_property_readonly(
            "occlusion",
            [](const py::object& self) {
                return samples_of(self, py::dtype::of<std::uint32_t>(), &Image::occlusion);
            },
            "uint32, as hits: occluded secondary rays of each camera ray.")
        .def_readonly("ray_count", &Image::ray_count, "The rays that were traced.")
        .def_readonly("trace_ms", &Image::trace_ms, "The time of the trace in milliseconds.")
        .def_readonly("hits_hash", &Image::hits_hash,
                      "XXH3 (64 bits) of hits and occlusion: the same on every device and machine.")
        .def_readonly("image_hash", &Image::image_hash, "XXH3 (64 bits) of the pixels.")
        .def(
            "save",
            [](const Image& image, const std::filesystem::path& file) {
                if (file.extension() != ".png" && file.extension() != ".PNG")
                    throw py::value_error("save: " + file.string() +
                                          " does not end in .png, the format of the file");
                const GilRelease release;
                write_png(file.string(), image);
            },
            "Writes a PNG file, as a whole or not at all. Raises ValueError for another format.",
            arg("path"));

    py::class_<Comparison>(
        module, "Comparison",
        "The hits that differ in any bit. True if there are any; str() has the first ones.")
        .def_readonly("compared", &Comparison::compared, "The number of rays or pixels.")
        .def_readonly("different", &Comparison::different, "The number of those that differ.")
        .def_property_readonly("equal", &Comparison::equal, "Whether none differs.")
        .def_property_readonly(
            "differences", &differences_of,
            "The first ones that differ, with the fields index, first and second (hit_dtype).")
        .def("__bool__", [](const Comparison& comparison) { return !comparison.equal(); })
        .def("__str__", &describe);
    module.def(
        "compare", &compare_any,
        R"(Compares two scenes by tracing rays in both, or two images by hits, occlusion and pixels.

rays: as Scene.intersect() takes them; needed for scenes, and not taken for images
keep: how many of those that differ Comparison.differences has at most)",
        arg("first"), arg("second"), arg("rays") = py::none(), arg("keep") = 10);
}

void bind_update(py::module_& module) {
    py::class_<Update>(module, "Update",
                       "What Scene.update() did. A part that did not happen takes 0 ms.")
        .def_property_readonly(
            "step", [](const Update& update) { return to_string(update.step); },
            R"("build" (another set of meshes), "keep" (nothing moved), "refit", "restructure"
(refitted, and degraded parts built again), "rebuild", or "swap" (a tree from the background, refitted).)")
        .def_readonly("reason", &Update::reason, "Why, as a clause for people.")
        .def_readonly("cost_ratio", &Update::cost_ratio,
                      "The cost of the tree relative to that when it was built, or 1.")
        .def_readonly("build_pending", &Update::build_pending,
                      "Whether a tree is being built in the background.")
        .def_readonly("left_out", &Update::left_out, "A list of LeftOut.")
        .def_property_readonly("milliseconds", &Update::milliseconds, "The sum of all parts.")
        .def_readonly("read_ms", &Update::read_ms, "Reading the arrays of points.")
        .def_readonly("upload_ms", &Update::upload_ms, "Positions and trees to the device.")
        .def_readonly("refit_ms", &Update::refit_ms)
        .def_readonly("decide_ms", &Update::decide_ms, "Finding the cost ratio, and deciding.")
        .def_readonly("restructure_ms", &Update::restructure_ms)
        .def_readonly("rebuild_ms", &Update::rebuild_ms);
    py::class_<LeftOut>(
        module, "LeftOut",
        "Points of a mesh whose triangles are not hit at this pose, and such triangles.")
        .def_readonly("geom_id", &LeftOut::geom_id)
        .def_readonly("not_finite", &LeftOut::not_finite, "NaN, infinite, or beyond float32.")
        .def_readonly("too_far", &LeftOut::too_far,
                      "Outside the bounds, and 2^37 times as far from the origin as most.")
        .def_readonly("too_small", &LeftOut::too_small,
                      "Triangles whose area is lost in the steps of 2^-60 of the scene's size.");
    py::class_<EdgeCounts>(module, "EdgeCounts", "Of Scene.edge_counts().")
        .def_readonly("open", &EdgeCounts::open, "Edges of one triangle.")
        .def_readonly("shared", &EdgeCounts::shared, "Edges of more than two triangles.")
        .def_readonly("turned", &EdgeCounts::turned,
                      "Edges that two triangles run through in one direction.")
        .def_readonly("uneven", &EdgeCounts::uneven,
                      "Edges that are run through more often in one direction.")
        .def_readonly("twins", &EdgeCounts::twins,
                      "Triangles of which another has the same places in the opposite direction.")
        .def_property_readonly(
            "is_closed", [](const EdgeCounts& edges) { return edges.is_closed(); },
            "True if insides and signs of distances are those of a solid.");
    py::class_<TreeStatistics>(module, "TreeStatistics", "Of Scene.tree_statistics().")
        .def_readonly("sah_cost", &TreeStatistics::sah_cost,
                      "Expected visits of nodes and tests of triangles of a random ray.")
        .def_readonly("node_count", &TreeStatistics::node_count)
        .def_readonly("leaf_count", &TreeStatistics::leaf_count)
        .def_readonly("depth", &TreeStatistics::depth)
        .def_readonly("bytes", &TreeStatistics::bytes)
        .def_readonly("hash", &TreeStatistics::hash,
                      "XXH3 (64 bits) of nodes and leaves: the same on every device.");
}

}  // namespace

void bind_scene(py::module_& module) {
    py::class_<Cancel>(module, "Cancel",
                       R"(Ends calls that take one, in any number and in any thread:

    cancel = morphray.Cancel()
    threading.Timer(10, cancel.set).start()
    image = scene.render((4096, 4096), cancel=cancel)   # raises Error "cancelled" after 10 s)")
        .def(py::init<>())
        .def("set", &Cancel::set, "Ends all calls that have this Cancel now or later.")
        .def("clear", &Cancel::clear, "Lets calls that begin from now on run to their end.")
        .def("is_set", &Cancel::is_set, "Whether set() has been called since the last clear().");
    bind_images(module);
    bind_update(module);
    const Auto automatic;
    py::class_<PyScene> scene_class(module, "Scene",
                                    R"(Deforming triangle meshes, the tree over them, and queries.

points:    (V, 3) float32 or float64, in any units, any distance apart: a numpy.ndarray, or what has
           __dlpack__ on the CPU. Borrowed: each update() reads the array in place, so write into it
           (points[:] = ...), and do not resize it; float64, less origin, is rounded to float32. A list is
           copied: later poses are given to update(). Triangles with points that are NaN or infinite are
           never hit.
triangles: (T, 3) integers of any type, or a list, copied. Without triangles, points is a list of
           meshes: morphray.Mesh, or tuples of (points, triangles[, deforms[, albedo[, textures]]]),
           with geom_ids 0, 1, ... in order.
device:    a Device, "cpu", "vulkan" or "brute"
bounds:    (lower, upper): the part of space that the meshes move in, which they may leave. With the
           same bounds, equal positions give equal bits on all machines and devices, whatever the poses
           before. None: the bounds of the first pose.
update:    how the tree follows the meshes: "auto", "refit", "rebuild", or "every:K" to build a tree
           after K poses. Results do not depend on it.
budget_ms, budget: for "auto", the time budget of an update for repairs of the tree: milliseconds, or,
           if they are 0, a part of the time that refit and queries of a pose take
deterministic: for "auto", decide by counts instead of times, so that all runs decide the same
deforms:   whether update() reads the points again
albedo:    for images, the linear colour of each triangle, copied: (T, 3) uint8, or (T,) uint32 with red
           in the lowest byte. None: light grey.
record_cost_ratio: find Update.cost_ratio at each update
textures:  for images by shading="lit", a morphray.Textures, copied; albedo multiplies them
origin:    three numbers that are subtracted in float64 from all points and rays before they are rounded
           to float32, and added to closest points. None: near the middle of the first mesh if its points
           are float64, and rounding would move one by more than 1e-6 of their size, as for UTM; else 0.
           A warning tells if points are moved so far all the same.

Any number of threads may query a scene at the same time. A change, update(), attach() or detach(), that
meets another call raises Error "busy". Ctrl-C ends queries, images, Scene() and update(); a scene whose
update() it ended is of no use any more.

Raises TypeError for another dtype, ValueError for a shape or strides that do not fit, Error "bad_input"
for an index out of range, "bad_argument", "unavailable" and "limit".)");
    scene_class
        .def(py::init(&make_scene), arg("points"), arg("triangles") = py::none(), py::kw_only(),
             arg("device") = "cpu", arg("bounds") = py::none(), arg("update") = "auto",
             arg("budget_ms") = automatic.budget_ms, arg("budget") = automatic.budget,
             arg("deterministic") = false, arg("deforms") = true, arg("albedo") = py::none(),
             arg("record_cost_ratio") = false, arg("textures") = py::none(),
             arg("origin") = py::none())
        .def("update", &update,
             R"(Brings the tree to the points, which it reads again. Returns an Update.

With geom_id it reads count points of one mesh from first on, or all from there. Raises Error
"bad_argument" for a mesh or points that are not there.)",
             arg("geom_id") = py::none(), arg("first") = 0, arg("count") = py::none())
        .def(
            "update",
            [](PyScene& scene, const py::object& geom_id, const py::object& points) {
                const char* const wanted = "update: a geom_id, a whole number, first";
                return scene.update(value_of<std::uint32_t>(geom_id, wanted), points);
            },
            "Borrows other points for a mesh from now on, as many as it has, and reads them.",
            arg("geom_id"), arg("points") = py::none())
        .def(
            "update",
            [](PyScene& scene, const py::object& poses, const py::object& geom_ids) {
                return scene.update(poses_of(poses, geom_ids));
            },
            R"(Moves meshes by matrices: a point p becomes M p + t of its rest point p. Returns an Update.

poses:    (n, 3, 4) float32 or float64: [M | t] of each mesh, in the units of the points. M may scale,
          shear and mirror; a mirror keeps the order of corners, which turns the mesh inside out.
geom_ids: n whole numbers, each once

The first pose of a mesh copies its points, rounded to float32, as rest points: 12 bytes a point. From then
on update() leaves the mesh alone; update(geom_id) and update(geom_id, points) read rest points and keep
the pose. M is rounded to float32, and so is t less origin. Each coordinate is
((m0 * x + m1 * y) + m2 * z) + t in float32.

Raises Error "bad_argument", which changes nothing, for numbers that are not finite as float32, and for a
geom_id that is not there or comes twice.)",
            py::kw_only(), arg("poses"), arg("geom_ids"))
        .def(
            "update_with_new_bounds", [](PyScene& scene) { return scene.update(true); },
            "update(), with the bounds of all points from then on, as Scene(...) without bounds.")
        .def(
            "attach",
            [](PyScene& scene, const py::object& points, const py::object& triangles, bool deforms,
               const py::object& albedo, const py::object& textures) {
                return scene.attach(borrow(points, triangles, deforms, albedo, textures));
            },
            "Adds a mesh, from the next update() on. Returns its geom_id, the lowest free one.",
            arg("points"), arg("triangles"), arg("deforms") = true, arg("albedo") = py::none(),
            arg("textures") = py::none())
        .def("detach", &PyScene::detach, "Removes a mesh from the next update() on.",
             arg("geom_id"))
        .def("last_update", reading(&Scene::last_update),
             "What the last build or update() did, as far as it is known by now.")
        .def("edge_counts", reading(&Scene::edge_counts),
             "The edges where the surface is not that of a solid, at the pose of the first call.")
        .def("render", &render,
             R"(Renders an Image with a pinhole camera and a light.

What is None is chosen so that the bounds of the scene fill the image.

size:        (width, height) in pixels, from 1 to 65536 a side and at most 2^28 in all
eye, target, up, light: three numbers each, in the units of the points
fov:         vertical, in degrees
rays:        "primary", "shadow" (and a ray to the light from each hit) or "ao" (and
             ambient-occlusion rays from each hit)
ao_count:    ambient-occlusion rays a camera ray, up to 256
ao_distance: their length. 0: a quarter of the diagonal of the bounds
shading:     "plain" (by `rays`), "lit" (a light with shadows, and ambient occlusion), or what is
             shown as colours: "normal", "depth" or "prim"
samples:     camera rays a pixel, 1, 4, 16 or 64; hits are then those of all samples
flat:        without smooth normals in "lit" and "normal"
cancel:      a morphray.Cancel, which ends the call with Error "cancelled"

Raises Error "bad_input" for an impossible view, "bad_argument" and "limit".)",
             arg("size") = py::make_tuple(1024, 1024), py::kw_only(), arg("eye") = py::none(),
             arg("target") = py::none(), arg("up") = py::make_tuple(0.0, 1.0, 0.0),
             arg("fov") = View{}.fov, arg("light") = py::none(), arg("rays") = "primary",
             arg("ao_count") = View{}.ao_count, arg("ao_distance") = View{}.ao_distance,
             arg("shading") = "plain", arg("samples") = View{}.samples, arg("flat") = View{}.flat,
             arg("cancel") = py::none())
        .def("_render_views", &render_views)
        .def(
            "on",
            [](PyScene& scene, const py::object& device) { return scene.on(device_of(device)); },
            "A scene over the same arrays with a copy of this tree on another device.",
            arg("device"))
        .def("tree_statistics", reading(&Scene::tree_statistics),
             "Reads the tree back from the device.")
        .def_property_readonly("device", &PyScene::device, "The Device that traces.")
        .def_property_readonly("bounds", &bounds,
                               "(lower, upper), two (3,) float64, of the finite points; lower > "
                               "upper without any.")
        .def_property_readonly(
            "origin", [](PyScene& scene) { return py::array_t<double>(3, scene.origin().data()); },
            "(3,) float64: what is subtracted from points and rays before they are rounded.")
        .def_property_readonly("triangle_count", reading(&Scene::triangle_count))
        .def_property_readonly("vertex_count", reading(&Scene::vertex_count))
        .def("__repr__", [](const PyScene& scene) {
            return "<morphray.Scene on " + scene.device().name() + ">";
        });
    bind_queries(scene_class);
}

}  // namespace morphray::python
