// Views that are refused.
#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <string>

#include "tests/common/scene/views.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;

// The kind of error with which a view is refused, or nothing.
std::optional<ErrorKind> refusal(const ViewSpec& view, const char* about = "") {
    const std::optional<Error> error = test::error_of([&] { params_of(view, box(-1, 1)); });
    if (!error) return std::nullopt;
    EXPECT_NE(std::string(error->what()).find(about), std::string::npos) << error->what();
    return error->kind();
}

TEST(MakeImageParams, RefusesAnEyeInTheTarget) {
    ViewSpec view = some_view();
    view.target = view.eye;
    EXPECT_EQ(refusal(view, "eye and target"), ErrorKind::kBadInput);
}

TEST(MakeImageParams, RefusesAnUpVectorThatPointsAlongTheView) {
    ViewSpec view = some_view();
    for (const double scale : {1.0, -1.0, 1e-300, 1e300}) {
        view.up = {-2.5 * scale, -2.25 * scale, -4.875 * scale};
        EXPECT_EQ(refusal(view, "up vector"), ErrorKind::kBadInput) << scale;
        view.up[0] *= 0.9999;
        EXPECT_EQ(refusal(view), std::nullopt) << scale;
    }
}

TEST(MakeImageParams, RefusesImpossibleFieldsOfView) {
    ViewSpec view = some_view();
    for (const double fov : {0.0, -0.0, -5.0, 180.0, 360.0, kNan, kInfinity}) {
        view.fov = fov;
        EXPECT_EQ(refusal(view, "field of view"), ErrorKind::kBadInput) << fov;
    }
    for (const double fov : {1e-300, 1e-6, 179.999}) {
        view.fov = fov;
        EXPECT_EQ(refusal(view), std::nullopt) << fov;
    }
    view.fov = std::nextafter(180.0, 0.0);
    EXPECT_EQ(refusal(view, "too wide"), ErrorKind::kBadInput);
}

TEST(MakeImageParams, RefusesNumbersThatAreNotFinite) {
    for (const double bad : {kNan, kInfinity, -kInfinity}) {
        for (int axis = 0; axis < 3; ++axis) {
            ViewSpec view = some_view();
            (*view.eye)[axis] = bad;
            EXPECT_EQ(refusal(view, "eye"), ErrorKind::kBadInput);
            view = some_view();
            (*view.target)[axis] = bad;
            EXPECT_EQ(refusal(view, "target"), ErrorKind::kBadInput);
            view = some_view();
            view.up[axis] = bad;
            EXPECT_EQ(refusal(view, "up vector"), ErrorKind::kBadInput);
            view = some_view();
            view.light = {1, 1, 1};
            (*view.light)[axis] = bad;
            EXPECT_EQ(refusal(view, "light"), ErrorKind::kBadInput);
        }
        ViewSpec view = some_view();
        view.ao_distance = bad;
        EXPECT_EQ(refusal(view, "ambient-occlusion"), ErrorKind::kBadInput);
    }
    ViewSpec view = some_view();
    view.ao_distance = -1;
    EXPECT_EQ(refusal(view, "ambient-occlusion"), ErrorKind::kBadInput);
}

TEST(MakeImageParams, RefusesEyesAndLightsAMillionScenesAway) {
    ViewSpec view = some_view();
    view.eye = {0, 0, 0x1p20};
    EXPECT_EQ(refusal(view), std::nullopt);
    view.eye = {0, 0, 0x1.001p20};
    view.light = {1, 1, 1};
    EXPECT_EQ(refusal(view, "eye"), ErrorKind::kBadInput);
    view = some_view();
    view.light = {0, -1e9, 0};
    EXPECT_EQ(refusal(view, "light"), ErrorKind::kBadInput);
    view.light.reset();
    view.target = {1e300, 0, 0};
    EXPECT_EQ(refusal(view), std::nullopt);
}

TEST(MakeImageParams, RefusesImagesTooLargeOrWithoutPixels) {
    const struct {
        std::uint32_t width;
        std::uint32_t height;
        std::optional<ErrorKind> kind;
    } cases[] = {{0, 5, ErrorKind::kBadArgument},   {5, 0, ErrorKind::kBadArgument},
                 {1, 65537, ErrorKind::kLimit},     {0xFFFFFFFF, 0xFFFFFFFF, ErrorKind::kLimit},
                 {16385, 16384, ErrorKind::kLimit}, {16384, 16384, std::nullopt},
                 {65536, 4096, std::nullopt}};
    for (const auto& [width, height, kind] : cases) {
        ViewSpec view = some_view();
        view.width = width;
        view.height = height;
        EXPECT_EQ(refusal(view), kind) << width << ' ' << height;
    }
}

TEST(MakeImageParams, RefusesTooManyOcclusionRaysOrNone) {
    ViewSpec view = some_view();
    view.ao_count = 0;
    EXPECT_EQ(refusal(view), ErrorKind::kBadArgument);
    view.ao_count = 257;
    EXPECT_EQ(refusal(view), ErrorKind::kLimit);
    view.ao_count = 0x80000000u;
    EXPECT_EQ(refusal(view), ErrorKind::kLimit);
}

}  // namespace
}  // namespace mray
