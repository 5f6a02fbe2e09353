// Files that hold one ray with the triangles that decide it, for another machine or a bug report.
#pragma once

#include <string>
#include <vector>

#include "app/base/numbers.h"
#include "common/interop/params.h"
#include "common/interop/ray.h"
#include "common/scene/mesh.h"

namespace mray::app {

/// A pixel of an image. All coordinates are in scene space; hits name triangles of the scene.
struct RayBundle {
    std::string scene;
    /// The tracer of the pixel, in words.
    std::string traced_by;
    double frame = 0;
    Pixel pixel;
    /// The whole image, of camera rays alone.
    ImageParams image = {};
    Ray ray = {};
    /// The hit in the image, that of the ray alone, and that of brute force over all triangles.
    Hit in_image = no_hit();
    Hit alone = no_hit();
    Hit brute = no_hit();

    std::uint64_t scene_triangles = 0;
    /// Some or all triangles of the scene, in its order, and their numbers in the scene.
    Topology topology;
    std::vector<std::uint32_t> prim_ids;
    std::vector<vec3> positions;

    /// A hit of `topology` as one of the scene.
    Hit in_scene(Hit hit) const {
        if (hit.prim_id != kNoPrim) hit.prim_id = prim_ids[hit.prim_id];
        return hit;
    }
};

/// Whether the name is that of a bundle: it ends in .json.
bool is_bundle_name(const std::string& name);

/// The bundle as JSON, with every number exact.
std::string bundle_text(const RayBundle& bundle);

/// Throws Error(kBadInput), with the line if it is not JSON, for a file that bundle_text did not
/// make, as far as that can be seen.
RayBundle read_bundle(const std::string& file);

}  // namespace mray::app
