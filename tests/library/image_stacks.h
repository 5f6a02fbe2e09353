// Stacks of views, compared with the images of the views one by one.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "morphray/images.hpp"
#include "tests/library/scenes.h"

namespace mray::test {

/// Arrays for all channels.
struct StackArrays {
    std::vector<float> depth, distance;
    std::vector<std::uint32_t> geom_id, prim_id, shaded;
    std::vector<morphray::Vec3> normal;
    std::vector<std::array<float, 2>> uv;

    explicit StackArrays(std::size_t pixels)
        : depth(pixels),
          distance(pixels),
          geom_id(pixels),
          prim_id(pixels),
          shaded(pixels),
          normal(pixels),
          uv(pixels) {}

    morphray::ImageStack stack() { return {depth, distance, geom_id, prim_id, normal, uv, shaded}; }
    bool operator==(const StackArrays&) const = default;
};

/// A camera that looks along -z from (x, y, z), turned by `angle` around its axis, with different
/// focal lengths and its principal point beside the middle.
inline morphray::View pinhole_view(double x, double y, double z, double angle, std::uint32_t width,
                                   std::uint32_t height) {
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    morphray::View view;
    view.pinhole = morphray::Pinhole{{{{c, s, 0, x}, {s, -c, 0, y}, {0, 0, -1, z}}},
                                     0.9 * height,
                                     1.1 * height,
                                     0.4 * width,
                                     0.55 * height};
    view.width = width;
    view.height = height;
    return view;
}

/// Views of both kinds around a mesh of size 2.
inline std::vector<morphray::View> mixed_views(std::size_t count, std::uint32_t width,
                                               std::uint32_t height) {
    std::vector<morphray::View> views;
    for (std::size_t i = 0; i < count; ++i) {
        const double angle = 0.7 * static_cast<double>(i);
        if (i % 2 == 0) {
            views.push_back(
                pinhole_view(std::cos(angle), std::sin(angle), 4, angle, width, height));
        } else {
            views.push_back({.eye = morphray::Point{3 * std::cos(angle), 1, 3 * std::sin(angle)},
                             .target = morphray::Point{0.1, 0.2, 0},
                             .width = width,
                             .height = height});
        }
    }
    return views;
}

/// All channels have the bits of images of the views and of Scene::normals(). Those of rays, and
/// distances, are compared in tests/library/python/views_test.py.
inline void expect_stack_of_images(const morphray::Scene& scene,
                                   const std::vector<morphray::View>& views) {
    const std::size_t size = std::size_t{views[0].width} * views[0].height;
    StackArrays arrays(views.size() * size);
    morphray::ImageStack stack = arrays.stack();
    scene.render(views, stack);
    EXPECT_EQ(stack.ray_count, arrays.depth.size());
    StackArrays expected = arrays;
    for (std::size_t v = 0, at = 0; v < views.size(); ++v) {
        const morphray::Image image = scene.render(views[v]);
        scene.normals(image.hits, std::span(expected.normal).subspan(at, size));
        for (std::size_t i = 0; i < size; ++i, ++at) {
            const morphray::Hit& hit = image.hits[i];
            expected.depth[at] = hit.t;
            expected.geom_id[at] = hit.geom_id;
            expected.prim_id[at] = hit.prim_id;
            expected.uv[at] = {hit.u, hit.v};
            expected.shaded[at] = image.pixels[i];
            EXPECT_GE(arrays.distance[at], 0.999f * hit.t);
        }
    }
    EXPECT_TRUE(arrays == expected);
    const auto missed = std::ranges::count(arrays.prim_id, morphray::kNoPrim);
    EXPECT_GT(missed, 0);
    EXPECT_LT(missed, static_cast<std::ptrdiff_t>(arrays.prim_id.size()) * 9 / 10);
}

}  // namespace mray::test
