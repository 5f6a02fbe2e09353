#include "lab/accuracy/chart_scene.h"

#include <array>
#include <cmath>

#include "common/bvh/box.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/camera.h"

namespace mray::accuracy {
namespace {

/// The same tree over the positions in world space, with boxes of these floats.
Bvh tree_around(Bvh bvh, std::span<const vec3> positions) {
    std::vector<Box> leaf_boxes(bvh.leaves.size());
    for (std::size_t i = 0; i < bvh.leaves.size(); ++i) {
        for (std::uint32_t slot = 0; slot < kLeafVertices; ++slot) {
            const vec3 p = positions[bvh.leaf_vertices[i * kLeafVertices + slot]];
            LeafVertex& v = bvh.leaves[i].vertex[slot];
            v.x = p.x;
            v.y = p.y;
            v.z = p.z;
            if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z))
                leaf_boxes[i].extend(p);
        }
    }
    // Parents come before their children.
    std::vector<Box> node_boxes(bvh.nodes.size());
    for (std::size_t i = bvh.nodes.size(); i-- > 0;) {
        Node& node = bvh.nodes[i];
        for (std::uint32_t slot = 0; slot < kWidth && node.child[slot] != kEmptyChild; ++slot) {
            const std::uint32_t child = node.child[slot];
            const Box& box =
                (child & kLeafBit) != 0 ? leaf_boxes[child & ~kLeafBit] : node_boxes[child];
            set_slot_box(node, slot, box);
            node_boxes[i].extend(box);
        }
    }
    return bvh;
}

/// The origin of a ray in floats of world space, and the same point in scene space.
struct Origin {
    vec3 world;
    vec3 scene;
};

Origin origin_of(const SceneSpace& space, vec3 scene) {
    const vec3 world = space.to_world(scene);
    return {world, space.point_to_scene(world, "a ray's origin")};
}

void add(ChartScene& scene, const Origin& origin, vec3 dir, std::vector<Ray> ChartSpace::*rays) {
    const Ray ray{origin.scene, 0, dir, kInfiniteT};
    (scene.scene_space.*rays).push_back(ray);
    (scene.world_space.*rays).push_back({origin.world, 0, dir, kInfiniteT});
}

ImageParams snapped_camera(const ViewSpec& given, const WorldBounds& bounds,
                           const SceneSpace& space) {
    const ImageParams params = make_image_params(given, bounds, space);
    const vec3 eye = origin_of(space, params.camera.org).world;
    ViewSpec view = given;
    view.eye = Point{eye.x, eye.y, eye.z};
    return make_image_params(view, bounds, space);
}

void add_camera_rays(ChartScene& scene, const SceneSpace& space) {
    const Origin origin = origin_of(space, scene.params.camera.org);
    for (std::uint32_t y0 = 0; y0 < scene.params.height; y0 += kChartTileSide) {
        for (std::uint32_t x0 = 0; x0 < scene.params.width; x0 += kChartTileSide) {
            for (std::uint32_t i = 0; i < kChartTileSide * kChartTileSide; ++i) {
                const Ray ray = camera_ray(scene.params.camera, x0 + i % kChartTileSide,
                                           y0 + i / kChartTileSide);
                add(scene, {origin.world, ray.org}, ray.dir, &ChartSpace::camera_rays);
            }
        }
    }
}

void add_aimed_rays(ChartScene& scene, const SceneSpace& space, std::size_t count) {
    const std::vector<vec3>& positions = scene.scene_space.positions;
    if (scene.topology.triangles.empty()) return;
    Random random(7);
    // One ray in this many runs along an axis.
    constexpr std::size_t kAlongAxis = 8;
    for (std::size_t i = 0; i < count; ++i) {
        const uvec3 t = scene.topology.triangles[random.below(scene.topology.triangles.size())];
        const std::array<vec3, 3> corner{positions[t.x], positions[t.y], positions[t.z]};
        // A corner, a point of an edge, a point of the triangle.
        const double u = i % 3 == 0 ? 0 : random.real(0, 1);
        const double v = i % 3 < 2 ? 0 : random.real(0, 1 - u);
        const double reach = i % 2 == 0 ? 3 * kSceneExtent : kSceneExtent;
        vec3 org;
        vec3 target;
        for (int axis = 0; axis < 3; ++axis) {
            org[axis] = static_cast<float>(random.real(-reach, reach));
            target[axis] = static_cast<float>(corner[0][axis] +
                                              u * (double{corner[1][axis]} - corner[0][axis]) +
                                              v * (double{corner[2][axis]} - corner[0][axis]));
        }
        const bool along = i % kAlongAxis == kAlongAxis - 1;
        const auto axis = static_cast<int>(i / kAlongAxis % 3);
        if (along) {
            const float start = org[axis];
            org = target;
            org[axis] = start;
        }
        const Origin origin = origin_of(space, org);
        vec3 way = target - origin.scene;
        if (along) {
            way = vec3(0, 0, 0);
            way[axis] = target[axis] < origin.scene[axis] ? -1.0f : 1.0f;
        }
        const vec3 dir = canonical_direction(way);
        if (dir == vec3(0, 0, 0) || !is_finite_vertex(target)) continue;
        add(scene, origin, dir, &ChartSpace::aimed_rays);
    }
}

}  // namespace

ChartScene make_chart_scene(const ChartInput& input, std::uint32_t side, std::size_t aimed) {
    ChartScene scene;
    scene.name = input.name;
    scene.topology = input.topology;
    scene.world_space.positions = input.positions;
    const WorldBounds bounds = bounds_of(scene.world_space.positions);
    const SceneSpace space(bounds);
    scene.scene_space.positions.resize(input.positions.size());
    space.to_scene(scene.world_space.positions, scene.scene_space.positions);
    scene.scene_space.bvh = build_bvh(scene.topology, scene.scene_space.positions);
    scene.world_space.bvh = tree_around(scene.scene_space.bvh, scene.world_space.positions);
    ViewSpec view;
    view.width = view.height = side;
    view.fov = kChartFov;
    scene.params = snapped_camera(view, bounds, space);
    add_camera_rays(scene, space);
    add_aimed_rays(scene, space, aimed);
    return scene;
}

}  // namespace mray::accuracy
