// Views and images that must be refused, and with which exit code.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "common/camera_setup.h"
#include "common/error.h"

namespace morphray {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

ViewSpec some_view() {
    ViewSpec view;
    view.eye = {3, 2, 5};
    view.target = {0.5, -0.25, 0.125};
    return view;
}

// The code with which a view is refused, or kOk.
ExitCode refusal(const ViewSpec& view, const char* about = "") {
    try {
        const UserBounds bounds = {{-1, -1, -1}, {1, 1, 1}};
        make_image_params(view, bounds, SceneSpace(bounds));
        return ExitCode::kOk;
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find(about), std::string::npos) << error.what();
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
        return error.code();
    }
}

TEST(MakeImageParams, RefusesAnEyeInTheTarget) {
    ViewSpec view = some_view();
    view.target = view.eye;
    EXPECT_EQ(refusal(view, "eye and target"), ExitCode::kBadInput);
    view.eye = {0, 0, 0};
    view.target = {0, -0.0, 0};
    EXPECT_EQ(refusal(view, "eye and target"), ExitCode::kBadInput);
}

TEST(MakeImageParams, RefusesAnUpVectorThatPointsAlongTheView) {
    ViewSpec view = some_view();
    for (const double scale : {1.0, -1.0, 1e-300, 1e300}) {
        view.up = {-2.5 * scale, -2.25 * scale, -4.875 * scale};
        EXPECT_EQ(refusal(view, "up vector"), ExitCode::kBadInput) << scale;
        view.up[0] *= 0.9999;
        EXPECT_EQ(refusal(view), ExitCode::kOk) << scale;
    }
    view.up = {0, 0, 0};
    EXPECT_EQ(refusal(view, "up vector"), ExitCode::kBadInput);
    view.up = {0, 1, 0};
    view.eye = {0, 5, 0};
    view.target = {0, 0, 0};
    EXPECT_EQ(refusal(view, "up vector"), ExitCode::kBadInput);
}

TEST(MakeImageParams, RefusesImpossibleFieldsOfView) {
    ViewSpec view = some_view();
    for (const double fov : {0.0, -0.0, -5.0, 180.0, 360.0, kNan, kInfinity}) {
        view.fov = fov;
        EXPECT_EQ(refusal(view, "field of view"), ExitCode::kBadInput) << fov;
    }
    for (const double fov : {1e-300, 1e-6, 179.999}) {
        view.fov = fov;
        EXPECT_EQ(refusal(view), ExitCode::kOk) << fov;
    }
    view.fov = std::nextafter(180.0, 0.0);
    EXPECT_EQ(refusal(view, "too wide"), ExitCode::kBadInput);
}

TEST(MakeImageParams, RefusesNumbersThatAreNotFinite) {
    for (const double bad : {kNan, kInfinity, -kInfinity}) {
        for (int axis = 0; axis < 3; ++axis) {
            ViewSpec view = some_view();
            (*view.eye)[axis] = bad;
            EXPECT_EQ(refusal(view, "eye"), ExitCode::kBadInput);
            view = some_view();
            (*view.target)[axis] = bad;
            EXPECT_EQ(refusal(view, "target"), ExitCode::kBadInput);
            view = some_view();
            view.up[axis] = bad;
            EXPECT_EQ(refusal(view, "up vector"), ExitCode::kBadInput);
            view = some_view();
            view.light = {1, 1, 1};
            (*view.light)[axis] = bad;
            EXPECT_EQ(refusal(view, "light"), ExitCode::kBadInput);
        }
        ViewSpec view = some_view();
        view.ao_distance = bad;
        EXPECT_EQ(refusal(view, "ambient-occlusion"), ExitCode::kBadInput);
    }
    ViewSpec view = some_view();
    view.ao_distance = -1;
    EXPECT_EQ(refusal(view, "ambient-occlusion"), ExitCode::kBadInput);
}

TEST(MakeImageParams, RefusesEyesAndLightsAMillionScenesAway) {
    ViewSpec view = some_view();
    view.eye = {0, 0, 0x1p20};
    EXPECT_EQ(refusal(view), ExitCode::kOk);
    view.eye = {0, 0, 0x1.001p20};
    view.light = {1, 1, 1};
    EXPECT_EQ(refusal(view, "eye"), ExitCode::kBadInput);
    view = some_view();
    view.light = {0, -1e9, 0};
    EXPECT_EQ(refusal(view, "light"), ExitCode::kBadInput);
    view.light.reset();
    view.target = {1e300, 0, 0};
    EXPECT_EQ(refusal(view), ExitCode::kOk);
}

TEST(MakeImageParams, RefusesImagesTooLargeOrWithoutPixels) {
    const struct {
        std::uint32_t width;
        std::uint32_t height;
        ExitCode code;
    } cases[] = {{0, 5, ExitCode::kUsage},
                 {5, 0, ExitCode::kUsage},
                 {65537, 1, ExitCode::kLimit},
                 {1, 65537, ExitCode::kLimit},
                 {1000000000, 1000000000, ExitCode::kLimit},
                 {0xFFFFFFFF, 0xFFFFFFFF, ExitCode::kLimit},
                 {16385, 16384, ExitCode::kLimit},
                 {65536, 4097, ExitCode::kLimit},
                 {16384, 16384, ExitCode::kOk},
                 {65536, 4096, ExitCode::kOk},
                 {1, 1, ExitCode::kOk},
                 {1, 65536, ExitCode::kOk}};
    for (const auto& [width, height, code] : cases) {
        ViewSpec view = some_view();
        view.width = width;
        view.height = height;
        EXPECT_EQ(refusal(view), code) << width << ' ' << height;
    }
}

TEST(MakeImageParams, RefusesTooManyOcclusionRaysOrNone) {
    ViewSpec view = some_view();
    view.ao_count = 0;
    EXPECT_EQ(refusal(view), ExitCode::kUsage);
    view.ao_count = 257;
    EXPECT_EQ(refusal(view), ExitCode::kLimit);
    view.ao_count = 0x80000000u;
    EXPECT_EQ(refusal(view), ExitCode::kLimit);
}

}  // namespace
}  // namespace morphray
