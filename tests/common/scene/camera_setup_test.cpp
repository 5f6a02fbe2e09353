// The camera against a pinhole camera worked out here, in long double and from angles.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include <glm/geometric.hpp>

#include "common/interop/camera.h"
#include "common/scene/camera_setup.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using Real = long double;
using Vec = glm::vec<3, Real>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

WorldBounds box(double lower, double upper) {
    return {{lower, lower, lower}, {upper, upper, upper}};
}

ImageParams params_of(const ViewSpec& view, const WorldBounds& bounds) {
    return make_image_params(view, bounds, SceneSpace(bounds));
}

ViewSpec some_view() {
    ViewSpec view;
    view.eye = {3, 2, 5};
    view.target = {0.5, -0.25, 0.125};
    view.fov = 50;
    view.width = 101;
    view.height = 77;
    return view;
}

constexpr Real kPi = 3.141592653589793238462643383279502884L;

Vec wide(const Point& p) { return {p[0], p[1], p[2]}; }

struct Basis {
    Vec forward, right, up;

    Basis(const Point& eye, const Point& target, const Point& up_vector) {
        forward = glm::normalize(wide(target) - wide(eye));
        const Vec given = wide(up_vector);
        up = glm::normalize(given - forward * glm::dot(given, forward));
        right = glm::cross(forward, up);
    }
};

// The pixel and depth at which a point in world space appears, from the upper left corner.
struct Projection {
    Real x;
    Real y;
    Real depth;
};

Projection project(const ViewSpec& view, const ResolvedView& resolved, const Vec& point) {
    const Basis b(resolved.eye, resolved.target, view.up);
    const Vec to = point - wide(resolved.eye);
    const Real depth = glm::dot(to, b.forward);
    // Pixels a unit of slope: half the height subtends half the field of view.
    const Real focal = view.height / 2.0L / std::tan(Real(view.fov) / 2 * kPi / 180);
    return {view.width / 2.0L + focal * glm::dot(to, b.right) / depth,
            view.height / 2.0L - focal * glm::dot(to, b.up) / depth, depth};
}

Vec corner(const WorldBounds& bounds, int i) {
    return {(i & 1) ? bounds.upper[0] : bounds.lower[0],
            (i & 2) ? bounds.upper[1] : bounds.lower[1],
            (i & 4) ? bounds.upper[2] : bounds.lower[2]};
}

TEST(MakeImageParams, SendsTheRayOfAPixelThroughThePointSeenThere) {
    // In a scene at the origin, and far from it.
    for (const double offset : {0.0, 1e7}) {
        const WorldBounds bounds = box(offset - 2, offset + 3);
        const SceneSpace space(bounds);
        for (const double fov : {1.0, 30.0, 90.0, 150.0}) {
            ViewSpec view = some_view();
            for (double& x : *view.eye) x += offset;
            for (double& x : *view.target) x += offset;
            view.up = {0.1, 2, -0.3};
            view.fov = fov;
            const Camera camera = make_image_params(view, bounds, space).camera;
            const ResolvedView resolved = resolve_view(view, bounds);
            const Real scale = space.length_to_scene(1);
            for (std::uint32_t y = 0; y < view.height; y += 19) {
                for (std::uint32_t x = 0; x < view.width; x += 25) {
                    const vec3 d = camera_direction(camera, x, y);
                    const Vec point = wide(*view.eye) + Vec(d) * (7 / scale);
                    const Projection p = project(view, resolved, point);
                    // Float directions are good to some 2^-23; the tolerance is that in pixels.
                    const double tolerance = 1e-3 + 40 / fov * 0x1p-21 * view.height;
                    EXPECT_NEAR(double(p.x), x + 0.5, tolerance) << fov;
                    EXPECT_NEAR(double(p.y), y + 0.5, tolerance) << fov;
                    EXPECT_GT(p.depth, 0);
                }
            }
            const vec3 eye = space.point_to_scene(to_dvec3(*view.eye), "eye");
            EXPECT_EQ(camera.org, snap_point(eye));
        }
    }
}

TEST(MakeImageParams, LooksAlikeAtEveryScaleThatIsAPowerOfTwo) {
    const ImageParams expected = params_of(some_view(), box(-1, 1));
    for (const int exponent : {-100, -3, 7, 90}) {
        const double scale = std::ldexp(1.0, exponent);
        ViewSpec view = some_view();
        for (double& x : *view.eye) x *= scale;
        for (double& x : *view.target) x *= scale;
        const ImageParams actual = params_of(view, box(-scale, scale));
        EXPECT_EQ(actual.camera.org, expected.camera.org);
        EXPECT_EQ(actual.camera.corner, expected.camera.corner);
        EXPECT_EQ(actual.camera.du, expected.camera.du);
        EXPECT_EQ(actual.camera.dv, expected.camera.dv);
        EXPECT_EQ(actual.light, expected.light);
        EXPECT_EQ(actual.ao_tfar, expected.ao_tfar);
    }
}

TEST(ResolveView, FillsTheImageWithTheBounds) {
    const WorldBounds shapes[] = {box(-1, 1),
                                  box(100, 101),
                                  {{-5, 0, -5}, {5, 0.2, 5}},
                                  {{0, 0, 0}, {0.1, 9, 0.1}},
                                  {{-2, -3, -4}, {-1, -2, -3.5}},
                                  box(-1e-40, 1e-40),
                                  box(-3e38, 3e38)};
    int spanned = 0;
    for (const WorldBounds& bounds : shapes) {
        for (const double fov : {0.5, 20.0, 45.0, 100.0, 170.0}) {
            for (const auto& [width, height] :
                 {std::pair{512u, 512u}, {1920u, 300u}, {40u, 900u}}) {
                ViewSpec view;
                view.fov = fov;
                view.width = width;
                view.height = height;
                const ResolvedView resolved = resolve_view(view, bounds);
                // How near to the left, right, upper and lower edge a corner is.
                std::array<Real, 4> fill = {-1, -1, -1, -1};
                const Real radius = glm::length(corner(bounds, 7) - corner(bounds, 0)) / 2;
                Real nearest = 1e4L * radius;
                for (int i = 0; i < 8; ++i) {
                    const Projection p = project(view, resolved, corner(bounds, i));
                    nearest = std::min(nearest, p.depth);
                    const Real x = 2 * p.x / width - 1;
                    const Real y = 2 * p.y / height - 1;
                    const std::array<Real, 4> here = {-x, x, -y, y};
                    for (int k = 0; k < 4; ++k) fill[k] = std::max(fill[k], here[k]);
                }
                EXPECT_GT(nearest, 0.049 * radius);
                for (const Real edge : fill) EXPECT_LT(edge, 1) << fov << ' ' << width;
                // The bounds span the image from one edge to the other, unless they would be too
                // close to the eye.
                if (nearest > 0.051 * radius) {
                    ++spanned;
                    EXPECT_GT(std::max(std::min(fill[0], fill[1]), std::min(fill[2], fill[3])),
                              0.98)
                        << fov << ' ' << width;
                }
            }
        }
    }
    EXPECT_GT(spanned, 70);
}

TEST(ResolveView, LooksFromAboveTheFrontRightAtTheMiddle) {
    const ResolvedView resolved = resolve_view({}, box(2, 6));
    const Vec back = wide(resolved.eye) - wide(resolved.target);
    // The direction does not depend on the shape of the bounds or of the image.
    for (const auto& [axis, share] : {std::pair{0, 0.45}, {1, 0.4}, {2, 1.0}})
        EXPECT_NEAR(double(back[axis] / back[2]), share, 1e-15);
    EXPECT_GT(resolved.eye[2], 6);
    // The target is on the plane of the middle that is at right angles to the view.
    const Vec beside = wide(resolved.target) - Vec(4);
    EXPECT_NEAR(double(glm::dot(beside, back) / glm::length(back)), 0, 1e-14);
    EXPECT_LT(glm::length(beside), 1);
}

TEST(ResolveView, LooksAtTheMiddleFromAGivenEyeAndAtAGivenTarget) {
    ViewSpec view;
    view.eye = {3, 9, -5};
    EXPECT_EQ(resolve_view(view, box(2, 6)).target, (Point{4, 4, 4}));
    view.eye.reset();
    view.target = {5, 3, 4};
    const ResolvedView resolved = resolve_view(view, box(2, 6));
    EXPECT_EQ(resolved.target, *view.target);
    for (int i = 0; i < 8; ++i) {
        const Projection p = project(view, resolved, corner(box(2, 6), i));
        EXPECT_GT(p.x, 0);
        EXPECT_LT(p.x, view.width);
        EXPECT_GT(p.y, 0);
        EXPECT_LT(p.y, view.height);
    }
}

TEST(ResolveView, LightsFromAboveLeftOfTheEyeAndOutsideOfTheBounds) {
    const std::optional<Point> eyes[] = {{},
                                         Point{0, 0, 9},
                                         Point{0.1, 0, 0.2},
                                         Point{-0.9, 0.9, 0.9},
                                         Point{-3, 0, 4},
                                         Point{4, -4, 4},
                                         Point{1e6, 5, 0}};
    for (const auto& eye : eyes) {
        for (const Point target : {Point{0, 0, 0}, Point{0.5, 0, -9}, Point{8, 0, 0}}) {
            ViewSpec view;
            view.eye = eye;
            view.target = target;
            const ResolvedView resolved = resolve_view(view, box(-1, 1));
            const Basis b(resolved.eye, resolved.target, view.up);
            const Vec to = wide(resolved.light) - wide(resolved.eye);
            EXPECT_GT(glm::dot(to, b.up), 0);
            EXPECT_LT(glm::dot(to, b.right), 0);
            EXPECT_GT(glm::length(wide(resolved.light)), std::sqrt(3.0));
        }
    }
}

// Vertices of an object that leans, and the lowest of them along up.
std::vector<vec3> leaning_object(float size, const vec3& offset) {
    std::vector<vec3> positions = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {0.5f, 3, -2}, {0.7f, 2, 0}};
    for (vec3& p : positions) p = size * p + offset;
    return positions;
}

TEST(FrameObject, ShowsTheVerticesInTheMiddleAndTheirShadowInTheImage) {
    const Point ups[] = {{0, 1, 0}, {0, 0, 2}, {0, -1, 0}, {1, 1, 0}};
    for (const auto& [size, offset] :
         {std::pair(1.0f, vec3(0, 0, 0)), {100.0f, vec3(9, 8, 7)}, {1e-30f, vec3(0, 0, 0)}}) {
        for (const Point& up : ups) {
            for (const auto& [width, height] :
                 {std::pair{512u, 512u}, {900u, 300u}, {200u, 700u}}) {
                ViewSpec view;
                view.up = up;
                view.width = width;
                view.height = height;
                std::vector<vec3> positions = leaning_object(size, offset);
                positions.emplace_back(float(kNan), 0.0f, 0.0f);
                const ViewSpec framed = frame_object(view, positions);
                positions.pop_back();
                ASSERT_TRUE(framed.eye && framed.target && framed.light);
                const ResolvedView resolved = resolve_view(framed, bounds_of(positions));
                const Real up_length = glm::length(wide(up));
                const auto height_of = [&](const Vec& p) {
                    return glm::dot(p, wide(up)) / up_length;
                };
                Real bottom = kInfinity;
                for (const vec3& p : positions)
                    bottom = std::min(bottom, height_of({p.x, p.y, p.z}));
                EXPECT_GT(height_of(wide(*framed.eye)), bottom);
                Real left = kInfinity, right = kInfinity, top = kInfinity, low = kInfinity;
                for (const vec3& p : positions) {
                    const Vec point = {p.x, p.y, p.z};
                    const Projection seen = project(view, resolved, point);
                    left = std::min(left, seen.x / width);
                    right = std::min(right, 1 - seen.x / width);
                    top = std::min(top, seen.y / height);
                    low = std::min(low, 1 - seen.y / height);
                    const Vec light = wide(*framed.light);
                    const Real part =
                        (height_of(light) - bottom) / (height_of(light) - height_of(point));
                    const Vec shadow = light + part * (point - light);
                    const Projection dark = project(view, resolved, shadow);
                    EXPECT_GT(std::min({dark.x, width - dark.x, dark.y, height - dark.y}), 0);
                }
                EXPECT_NEAR(double(left), double(right), 1e-3);
                EXPECT_NEAR(double(top), double(low), 1e-3);
                EXPECT_GT(std::min(left, top), 0.05);
            }
        }
    }
    // A light that is given stays; without a vertex so does the view.
    ViewSpec lit;
    lit.light = Point{1, 2, 3};
    EXPECT_EQ(frame_object(lit, leaning_object(1, {0, 0, 0})).light, lit.light);
    EXPECT_EQ(frame_object(lit, {}), lit);
}

TEST(ResolveView, GivesOcclusionAQuarterOfTheDiagonal) {
    const WorldBounds bounds = {{0, 0, 0}, {4, 4, 2}};
    EXPECT_DOUBLE_EQ(resolve_view({}, bounds).ao_distance, 1.5);
}

TEST(ResolveView, AcceptsScenesWithoutExtent) {
    const WorldBounds scenes[] = {
        {}, box(0, 0), box(5, 5), box(-1e-44f, -1e-44f), box(3e38f, 3e38f)};
    for (const WorldBounds& bounds : scenes) {
        const ResolvedView resolved = resolve_view({}, bounds);
        EXPECT_GT(glm::length(wide(resolved.eye) - wide(resolved.target)), 0);
        EXPECT_GT(resolved.ao_distance, 0);
        const ImageParams params = params_of({}, bounds);
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_TRUE(std::isfinite(params.camera.org[axis]));
            EXPECT_TRUE(std::isfinite(params.light[axis]));
        }
        EXPECT_GT(params.ao_tfar, 0);
        EXPECT_LE(params.ao_tfar, kInfiniteT);
    }
}

TEST(MakeImageParams, KeepsDirectionsWithinTheRangeOfTheHitRule) {
    for (const double fov : {1e-300, 1e-30, 1e-9, 45.0, 179.999}) {
        for (const auto& [width, height] : {std::pair{9u, 9u}, {60000u, 3u}, {3u, 60000u}}) {
            ViewSpec view = some_view();
            view.fov = fov;
            view.width = width;
            view.height = height;
            const Camera camera = params_of(view, box(-1, 1)).camera;
            for (const vec3 v : {camera.corner, camera.du, camera.dv}) {
                for (int axis = 0; axis < 3; ++axis) {
                    EXPECT_LE(std::fabs(v[axis]), 0x1p42f);
                    EXPECT_TRUE(v[axis] == 0 || std::fabs(v[axis]) >= 0x1p-60f);
                }
            }
        }
    }
}

/// Expects that a view is refused with this kind of error, about this, or taken.
void expect_refusal(const ViewSpec& view, std::optional<ErrorKind> kind,
                    const std::string& about = {}) {
    EXPECT_NO_THROW(resolve_view(view, box(-1, 1)));
    const std::optional<Error> error = test::error_of([&] { params_of(view, box(-1, 1)); });
    ASSERT_EQ(error ? std::optional(error->kind()) : std::nullopt, kind) << about;
    if (error) {
        EXPECT_TRUE(test::has(error->what(), about));
    }
}
constexpr ErrorKind kBad = ErrorKind::kBadInput;

TEST(MakeImageParams, RefusesViewsWithoutADirection) {
    ViewSpec view = some_view();
    view.target = view.eye;
    expect_refusal(view, kBad, "eye and target");
    view = some_view();
    for (const double scale : {1.0, -1.0, 1e-300, 1e300}) {
        view.up = {-2.5 * scale, -2.25 * scale, -4.875 * scale};
        expect_refusal(view, kBad, "up vector");
        view.up[0] *= 0.9999;
        expect_refusal(view, std::nullopt);
    }
}

TEST(MakeImageParams, RefusesImpossibleFieldsOfView) {
    ViewSpec view = some_view();
    for (const double fov : {0.0, -0.0, -5.0, 180.0, 360.0, kNan, kInfinity}) {
        view.fov = fov;
        expect_refusal(view, kBad, "field of view");
        ViewSpec without_eye;
        without_eye.fov = fov;
        EXPECT_TRUE(std::isfinite(resolve_view(without_eye, box(-1, 1)).eye[0])) << fov;
    }
    for (const double fov : {1e-300, 1e-6, 179.999}) {
        view.fov = fov;
        expect_refusal(view, std::nullopt);
    }
    view.fov = std::nextafter(180.0, 0.0);
    expect_refusal(view, kBad, "too wide");
}

TEST(MakeImageParams, RefusesNumbersThatAreNotFinite) {
    ViewSpec good = some_view();
    good.light = {1, 1, 1};
    for (const double bad : {kNan, kInfinity, -kInfinity}) {
        for (int axis = 0; axis < 3; ++axis) {
            for (const auto& [point, name] : {std::pair(&ViewSpec::eye, "eye"),
                                              {&ViewSpec::target, "target"},
                                              {&ViewSpec::light, "light"}}) {
                ViewSpec view = good;
                (*(view.*point))[axis] = bad;
                expect_refusal(view, kBad, name);
            }
            ViewSpec view = good;
            view.up[axis] = bad;
            expect_refusal(view, kBad, "up vector");
        }
        ViewSpec view = good;
        view.ao_distance = bad;
        expect_refusal(view, kBad, "ambient-occlusion");
    }
    good.ao_distance = -1;
    expect_refusal(good, kBad, "ambient-occlusion");
}

TEST(MakeImageParams, RefusesEyesAndLightsAMillionScenesAway) {
    ViewSpec view = some_view();
    view.eye = {0, 0, 0x1p20};
    view.target = {1e300, 0, 0};
    expect_refusal(view, std::nullopt);
    view.eye = {0, 0, 0x1.001p20};
    expect_refusal(view, kBad, "eye");
    view = some_view();
    view.light = {0, -1e9, 0};
    expect_refusal(view, kBad, "light");
}

TEST(MakeImageParams, RefusesImagesAndOcclusionOfOtherSizes) {
    const auto expect = [](std::uint32_t width, std::uint32_t height, std::uint32_t ao_count,
                           std::optional<ErrorKind> kind) {
        ViewSpec view = some_view();
        view.width = width;
        view.height = height;
        view.ao_count = ao_count;
        expect_refusal(view, kind);
    };
    expect(0, 5, 1, ErrorKind::kBadArgument);
    expect(5, 0, 1, ErrorKind::kBadArgument);
    expect(1, 65537, 1, ErrorKind::kLimit);
    expect(0xFFFFFFFF, 0xFFFFFFFF, 1, ErrorKind::kLimit);
    expect(16385, 16384, 1, ErrorKind::kLimit);
    expect(16384, 16384, 256, std::nullopt);
    expect(65536, 4096, 1, std::nullopt);
    expect(5, 5, 0, ErrorKind::kBadArgument);
    expect(5, 5, 257, ErrorKind::kLimit);
    expect(5, 5, 0x80000000u, ErrorKind::kLimit);
}

TEST(CameraRays, AreThoseOfThePixelsRowByRow) {
    ViewSpec view;
    view.width = 5;
    view.height = 3;
    const WorldBounds bounds{{-1, -1, -1}, {1, 1, 1}};
    const ImageParams params = make_image_params(view, bounds, SceneSpace(bounds));
    const std::vector<Ray> rays = camera_rays(params);
    ASSERT_EQ(rays.size(), 15u);
    for (std::uint32_t i = 0; i < 15; ++i)
        EXPECT_EQ(rays[i].dir, camera_ray(params.camera, i % 5, i / 5).dir) << i;
}

}  // namespace
}  // namespace mray
