// morphray: closest hits, any hits and images of deforming triangle meshes, with the same bits on
// every machine, thread count, instruction set and Vulkan device.
//
//     #include <morphray/morphray.hpp>
//     namespace mr = morphray;
//
//     std::vector<mr::Vec3> points = ...;              // read in place
//     std::vector<std::uint32_t> triangles = ...;      // three indices each
//     mr::Scene scene = mr::Scene::build({mr::packed(points), triangles});
//     mr::Hit hit = scene.intersect(mr::Ray{.org = {0, 0, 5}, .dir = {0, 0, -1}});
//     while (simulate(points)) {
//         scene.update();
//         scene.intersect(rays, hits);
//     }
#pragma once

#include "morphray/device.hpp"
#include "morphray/error.hpp"
#include "morphray/geometry.hpp"
#include "morphray/images.hpp"
#include "morphray/mesh.hpp"
#include "morphray/queries.hpp"
#include "morphray/scene.hpp"
#include "morphray/version.hpp"
