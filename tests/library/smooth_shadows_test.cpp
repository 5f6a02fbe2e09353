// Shadows on coarse meshes with smooth normals.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Image;
using morphray::MeshView;
using morphray::Point;
using morphray::Scene;
using morphray::Shading;
using morphray::View;

MeshView view_with_normals(const UserMesh& mesh) {
    MeshView view = mesh.view();
    view.appearance.smooth = mesh.triangles;
    return view;
}

View lit_view(const Point& eye, const Point& target, const Point& light) {
    return {.eye = eye,
            .target = target,
            .light = light,
            .width = 96,
            .height = 80,
            .shading = Shading::lit,
            .ao_count = 0};
}

using Vector = std::array<double, 3>;

Vector vector_of(const morphray::Vec3& p) { return {p.x, p.y, p.z}; }
Vector minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vector cross(const Vector& a, const Vector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double inner(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double norm(const Vector& a) { return std::sqrt(inner(a, a)); }

/// A coarse ball around the origin with its smooth normals, in doubles: the sums of the triangles'
/// cross products.
struct Ball {
    explicit Ball(int levels) : mesh(icosphere(levels)), normals(mesh.points.size()) {
        for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
            const Vector a = corner(i);
            const Vector n = cross(minus(corner(i + 1), a), minus(corner(i + 2), a));
            for (std::size_t k = 0; k < 3; ++k) {
                Vector& sum = normals[mesh.triangles[i + k]];
                for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += n[axis];
            }
        }
        for (Vector& n : normals) {
            const double length = norm(n);
            for (double& x : n) x /= length;
        }
    }

    Vector corner(std::size_t i) const { return vector_of(mesh.points[mesh.triangles[i]]); }
    Vector mean(const morphray::Hit& hit, const auto& of_corner) const {
        Vector sum = {};
        const double weights[] = {1.0 - hit.u - hit.v, hit.u, hit.v};
        for (std::size_t k = 0; k < 3; ++k) {
            const Vector value = of_corner(std::size_t{3} * hit.prim_id + k);
            for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += weights[k] * value[axis];
        }
        return sum;
    }
    /// The cosine between the smooth normal at a hit and the direction to the light.
    double facing(const morphray::Hit& hit, const Vector& light) const {
        const Vector point = mean(hit, [&](std::size_t i) { return corner(i); });
        const Vector n = mean(hit, [&](std::size_t i) { return normals[mesh.triangles[i]]; });
        const Vector to_light = minus(light, point);
        return inner(n, to_light) / (norm(n) * norm(to_light));
    }

    UserMesh mesh;
    std::vector<Vector> normals;
};

constexpr Point kEyes[] = {{0, 0, 4}, {3, 2, 1}, {-2, -3, 2}};
constexpr Point kLights[] = {{0, 9, 0}, {5, 3, 4}, {-7, 1, -2}, {1.5, 1.5, 0.5}, {400, -90, 30}};

/// The number of pixels in shadow whose smooth normal faces the light.
int dark_pixels(const Ball& ball, const Scene& scene, bool flat) {
    int dark = 0;
    for (const Point& eye : kEyes) {
        for (const Point& light : kLights) {
            View view = lit_view(eye, {0, 0, 0}, light);
            view.flat = flat;
            const Image image = scene.render(view);
            for (std::size_t i = 0; i < image.hits.size(); ++i) {
                if (!image.hits[i] || image.occlusion[i] == 0) continue;
                // Beyond the rounding of the cosine of floats.
                dark += ball.facing(image.hits[i], light) > 1e-6 ? 1 : 0;
            }
        }
    }
    return dark;
}

TEST(SmoothShadows, NothingThatFacesTheLightIsDarkOnACoarseBall) {
    for (const int levels : {1, 2, 3}) {
        const Ball ball(levels);
        const Scene scene = Scene::build(view_with_normals(ball.mesh));
        EXPECT_EQ(dark_pixels(ball, scene, false), 0) << levels;
        EXPECT_GT(dark_pixels(ball, scene, true), 100) << levels;
    }
}

}  // namespace
}  // namespace mray::test
