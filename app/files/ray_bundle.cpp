#include "app/files/ray_bundle.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <stdexcept>

#include "app/files/json_file.h"
#include "common/interop/camera.h"
#include "common/scene/camera_setup.h"
#include "common/version.h"
#include "tools/build/build_record.h"
#include "tools/text/json_writer.h"

namespace mray::app {
namespace {

constexpr const char* kCommand = "probe --bundle";
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;

/// A float as a double, whose shortest decimal text gives the float back.
Json of(vec3 p) { return {double{p.x}, double{p.y}, double{p.z}}; }

Json of(const Hit& hit) {
    if (hit.prim_id == kNoPrim) return nullptr;
    return {
        {"prim_id", hit.prim_id}, {"t", double{hit.t}}, {"u", double{hit.u}}, {"v", double{hit.v}}};
}

Json of(const ImageParams& p) {
    return {{"org", of(p.camera.org)}, {"corner", of(p.camera.corner)},
            {"du", of(p.camera.du)},   {"dv", of(p.camera.dv)},
            {"width", p.width},        {"height", p.height}};
}

float float_of(const JsonAt& json) {
    const double value = json.number();
    constexpr double kLargest = std::numeric_limits<float>::max();
    const auto rounded = static_cast<float>(std::clamp(value, -kLargest, kLargest));
    if (static_cast<double>(rounded) != value) throw std::invalid_argument("a float is not exact");
    if (std::fpclassify(rounded) == FP_SUBNORMAL)
        throw std::invalid_argument("a float is too small");
    return rounded;
}

std::uint32_t count_of(const JsonAt& json) {
    const std::optional<std::uint64_t> count = json.unsigned_integer();
    if (!count || *count > 0xFFFFFFFF) throw std::invalid_argument("a number is out of range");
    return static_cast<std::uint32_t>(*count);
}

vec3 vec3_of(const JsonAt& json) {
    return {float_of(json[0]), float_of(json[1]), float_of(json[2])};
}

Hit hit_of(const JsonAt& json) {
    if (json.is_null()) return no_hit();
    return {float_of(json.at("t")), float_of(json.at("u")), float_of(json.at("v")),
            count_of(json.at("prim_id"))};
}

/// Whether SceneSpace can make this vertex.
bool is_scene_vertex(vec3 p) {
    const vec3 invalid = {kInvalidCoordinate, kInvalidCoordinate, kInvalidCoordinate};
    if (p == invalid) return true;
    for (int axis = 0; axis < 3; ++axis) {
        const double cells = std::ldexp(double{p[axis]}, 40);
        if (!(std::abs(p[axis]) <= kSceneExtent) || cells != std::floor(cells)) return false;
    }
    return true;
}

bool same_bits(const Ray& a, const Ray& b) { return std::memcmp(&a, &b, sizeof(a)) == 0; }

void read_image(const JsonAt& json, RayBundle& bundle) {
    const JsonAt image = json.at("image");
    ImageParams& params = bundle.image;
    params.camera.org = vec3_of(image.at("org"));
    params.camera.corner = vec3_of(image.at("corner"));
    params.camera.du = vec3_of(image.at("du"));
    params.camera.dv = vec3_of(image.at("dv"));
    params.width = count_of(image.at("width"));
    params.height = count_of(image.at("height"));
    params.rays = kRaysPrimary;
    params.ao_count = 1;
    bundle.pixel = {count_of(json.at("pixel")[0]), count_of(json.at("pixel")[1])};
    const bool fits = bundle.pixel.x < params.width && bundle.pixel.y < params.height &&
                      params.width <= kMaxImageSide && params.height <= kMaxImageSide &&
                      std::uint64_t{params.width} * params.height <= kMaxPixels;
    if (!fits) throw std::invalid_argument("the pixel is not in the image, or the image too large");
    const JsonAt ray = json.at("ray");
    bundle.ray = {vec3_of(ray.at("org")), float_of(ray.at("tnear")), vec3_of(ray.at("dir")),
                  float_of(ray.at("tfar"))};
    if (!same_bits(bundle.ray, camera_ray(params.camera, bundle.pixel.x, bundle.pixel.y)))
        throw std::invalid_argument("the ray is not that of the pixel");
}

void read_mesh(const JsonAt& json, RayBundle& bundle) {
    const JsonAt positions = json.at("positions");
    for (std::size_t i = 0; i < positions.size(); ++i) {
        bundle.positions.push_back(vec3_of(positions[i]));
        if (!is_scene_vertex(bundle.positions.back()))
            throw std::invalid_argument("a position is not one of scene space");
    }
    bundle.topology.vertex_count = static_cast<std::uint32_t>(bundle.positions.size());
    const JsonAt triangles = json.at("triangles");
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const JsonAt triangle = triangles[i];
        const uvec3 corners = {count_of(triangle[0]), count_of(triangle[1]), count_of(triangle[2])};
        if (std::max({corners.x, corners.y, corners.z}) >= bundle.positions.size())
            throw std::invalid_argument("a triangle names a position that is not there");
        bundle.topology.triangles.push_back(corners);
    }
    bundle.topology.albedo.assign(bundle.topology.triangles.size(), kDefaultAlbedo);
    const JsonAt ids = json.at("prim_ids");
    for (std::size_t i = 0; i < ids.size(); ++i) {
        bundle.prim_ids.push_back(count_of(ids[i]));
        if (i > 0 && bundle.prim_ids[i - 1] >= bundle.prim_ids[i])
            throw std::invalid_argument("the numbers of triangles do not ascend");
    }
    if (bundle.prim_ids.size() != bundle.topology.triangles.size())
        throw std::invalid_argument("not every triangle has a number");
}

RayBundle bundle_of(const JsonAt& json) {
    if (!is_report_of(kCommand, json)) throw std::invalid_argument("is another report");
    RayBundle bundle;
    bundle.scene = json.at("scene").text();
    bundle.traced_by = json.at("traced_by").text();
    bundle.frame = json.at("frame").number();
    bundle.scene_triangles = count_of(json.at("scene_triangles"));
    read_image(json, bundle);
    read_mesh(json, bundle);
    bundle.in_image = hit_of(json.at("in_image"));
    bundle.alone = hit_of(json.at("alone"));
    bundle.brute = hit_of(json.at("brute"));
    return bundle;
}

}  // namespace

bool is_bundle_name(const std::string& name) {
    return name.ends_with(".json") && !name.starts_with("builtin:");
}

std::string bundle_text(const RayBundle& bundle) {
    Json json = {{"schema", "morphray/1"},
                 {"command", kCommand},
                 {"version", kVersionDetail},
                 {"built_with", build_record_json()}};
    json["scene"] = bundle.scene;
    json["scene_triangles"] = bundle.scene_triangles;
    json["traced_by"] = bundle.traced_by;
    json["frame"] = bundle.frame;
    json["pixel"] = {bundle.pixel.x, bundle.pixel.y};
    json["image"] = of(bundle.image);
    json["ray"] = {{"org", of(bundle.ray.org)},
                   {"dir", of(bundle.ray.dir)},
                   {"tnear", double{bundle.ray.tnear}},
                   {"tfar", double{bundle.ray.tfar}}};
    json["in_image"] = of(bundle.in_image);
    json["alone"] = of(bundle.alone);
    json["brute"] = of(bundle.brute);
    json["prim_ids"] = bundle.prim_ids;
    json["triangles"] = Json::array();
    for (const uvec3 t : bundle.topology.triangles) json["triangles"].push_back({t.x, t.y, t.z});
    json["positions"] = Json::array();
    for (const vec3 p : bundle.positions) json["positions"].push_back(of(p));
    return json_text(json, -1);
}

RayBundle read_bundle(const std::string& file) {
    return read_json_file(file, kMostBytes, kCommand, bundle_of);
}

}  // namespace mray::app
