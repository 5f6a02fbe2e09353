// Finds what is under the mouse in an animated mesh: once with a ray for each click, once from the
// hits that an image keeps. Both answers are checked by projecting the picked point back to the
// pixel.
#include <cmath>
#include <cstdio>
#include <morphray/morphray.hpp>

namespace mr = morphray;

namespace {

constexpr std::uint32_t kRings = 40, kSegments = 80;
constexpr std::uint32_t kWidth = 320, kHeight = 240;
constexpr double kFov = 45, kPi = 3.14159265358979323846, kEyeZ = 5;

// The camera is on the z axis and looks at the origin: half the height of the image at depth 1.
double half_height() { return std::tan(kFov / 2 * kPi / 180); }

// A ball that breathes.
void animate(std::vector<mr::Vec3>& points, double time) {
    points.clear();
    for (std::uint32_t ring = 0; ring <= kRings; ++ring) {
        for (std::uint32_t segment = 0; segment < kSegments; ++segment) {
            const double a = kPi * ring / kRings, b = 2 * kPi * segment / kSegments;
            const double radius = 1 + 0.2 * std::sin(6 * a + time) * std::sin(5 * b);
            points.push_back({static_cast<float>(radius * std::sin(a) * std::cos(b)),
                              static_cast<float>(radius * std::cos(a)),
                              static_cast<float>(radius * std::sin(a) * std::sin(b))});
        }
    }
}

std::vector<std::uint32_t> ball_triangles() {
    std::vector<std::uint32_t> triangles;
    for (std::uint32_t ring = 0; ring < kRings; ++ring) {
        for (std::uint32_t segment = 0; segment < kSegments; ++segment) {
            const std::uint32_t next = (segment + 1) % kSegments;
            const std::uint32_t a = ring * kSegments + segment, b = ring * kSegments + next;
            for (const std::uint32_t corner :
                 {a, b, a + kSegments, b, b + kSegments, a + kSegments})
                triangles.push_back(corner);
        }
    }
    return triangles;
}

// The ray through the point (x, y) of the image, in pixels from the upper left corner.
mr::Ray mouse_ray(double x, double y) {
    const double scale = 2 * half_height() / kHeight;
    return {.org = {0, 0, static_cast<float>(kEyeZ)},
            .dir = {static_cast<float>((x - kWidth / 2.0) * scale),
                    static_cast<float>((kHeight / 2.0 - y) * scale), -1}};
}

// The distance in pixels between the picked point and (x, y).
double error_px(const mr::Hit& hit, const std::vector<mr::Vec3>& points,
                const std::vector<std::uint32_t>& triangles, double x, double y) {
    const mr::Vec3& p0 = points[triangles[3 * hit.prim_id]];
    const mr::Vec3& p1 = points[triangles[3 * hit.prim_id + 1]];
    const mr::Vec3& p2 = points[triangles[3 * hit.prim_id + 2]];
    const double w = 1.0 - hit.u - hit.v;
    const double px = w * p0.x + hit.u * p1.x + hit.v * p2.x;
    const double py = w * p0.y + hit.u * p1.y + hit.v * p2.y;
    const double depth = kEyeZ - (w * p0.z + hit.u * p1.z + hit.v * p2.z);
    const double scale = kHeight / (2 * half_height());
    return std::hypot(kWidth / 2.0 + px / depth * scale - x,
                      kHeight / 2.0 - py / depth * scale - y);
}

}  // namespace

int main() {
    std::vector<mr::Vec3> points;
    animate(points, 0);
    const std::vector<std::uint32_t> triangles = ball_triangles();
    mr::Scene scene = mr::Scene::build({mr::packed(points), triangles}, mr::Device::cpu(),
                                       {.bounds = mr::Box{{-1.3, -1.3, -1.3}, {1.3, 1.3, 1.3}}});
    const mr::View view{.eye = mr::Point{0, 0, kEyeZ},
                        .target = mr::Point{0, 0, 0},
                        .fov = kFov,
                        .width = kWidth,
                        .height = kHeight};
    bool right = true;
    for (int pose = 0; pose < 5; ++pose) {
        animate(points, 0.4 * pose);  // as many points, so they stay where they are
        scene.update();
        const mr::Image image = scene.render(view);
        for (std::uint32_t y = 100; y < 140; y += 13) {
            for (std::uint32_t x = 140; x < 180; x += 7) {
                const mr::Hit clicked = scene.intersect(mouse_ray(x + 0.5, y + 0.5));
                const mr::Hit& drawn = image.hits[y * kWidth + x];
                right = right && clicked && drawn &&
                        error_px(clicked, points, triangles, x + 0.5, y + 0.5) < 0.01 &&
                        error_px(drawn, points, triangles, x + 0.5, y + 0.5) < 0.01;
            }
        }
        const mr::Hit centre = scene.intersect(mouse_ray(kWidth / 2.0, kHeight / 2.0));
        const mr::Hit outside = scene.intersect(mouse_ray(1, 1));
        std::printf("pose %d: triangle %u in the centre, depth %.4f\n", pose, centre.prim_id,
                    static_cast<double>(centre.t));
        right = right && centre && !outside;
    }
    return right ? 0 : 1;
}
