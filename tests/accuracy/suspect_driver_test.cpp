// A thousand images of the driver's own rays, where the device traces rays.
#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <set>

#include "accuracy/suspect/joined_meshes.h"
#include "accuracy/suspect/reproducer.h"
#include "accuracy/suspect/suspect.h"
#include "common/base/errors.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/scene/camera_setup.h"
#include "common/scene/scene_space.h"
#include "cpu/cpu_backend.h"
#include "gpu/ray_query/ray_query.h"

namespace mray::test {
namespace {

using namespace accuracy;

constexpr std::uint32_t kSide = 24;
constexpr std::size_t kImages = 1000;

/// Null on a device without ray queries, after a check that this is why.
std::unique_ptr<DriverRays> device_rays() {
    try {
        return gpu::make_ray_query();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUnavailable);
        EXPECT_NE(std::string(error.what()).find("lacks VK_KHR_"), std::string::npos);
        return nullptr;
    }
}

/// The camera rays of an image from a pseudo-random place, inside or outside of the mesh.
std::vector<Ray> image_rays(const WorldBounds& bounds, const SceneSpace& space,
                            std::mt19937& random) {
    ViewSpec view;
    view.width = view.height = kSide;
    Point eye{};
    Point target{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double size = bounds.upper[axis] - bounds.lower[axis];
        const auto part = [&] { return static_cast<double>(random()) * 0x1p-32; };
        eye[axis] = bounds.lower[axis] + size * (3 * part() - 1);
        target[axis] = bounds.lower[axis] + size * part();
    }
    view.eye = eye;
    view.target = target;
    return camera_rays(make_image_params(view, bounds, space));
}

TEST(DriverRays, AreJudgedOnAThousandImages) {
    const auto driver = device_rays();
    if (!driver) return;
    const auto ours = cpu::make_cpu_backend();
    const std::vector<FailureScene> scenes = suspect_scenes();
    std::mt19937 random(1);
    SuspectCounts sum;
    std::set<Fault> reproduced;
    std::size_t images = 0;
    for (const FailureScene& scene : scenes) {
        const WorldBounds bounds = bounds_of(scene.positions);
        const SceneSpace space(bounds);
        std::vector<vec3> positions(scene.positions.size());
        space.to_scene(scene.positions, positions);
        const Bvh bvh = build_bvh(scene.topology, positions);
        const PosedMesh mesh{scene.topology, positions, bvh, is_closed(scene.topology, positions)};
        const ExactReferee referee(scene.topology, positions, bvh);
        const auto hold = [&] {
            driver->set_scene(scene.topology, positions);
            ours->set_scene(scene.topology, positions, bvh);
        };
        hold();
        for (std::size_t n = 0; n < (kImages + scenes.size() - 1) / scenes.size(); ++n, ++images) {
            const std::vector<Ray> rays = image_rays(bounds, space, random);
            const Judged judged = judge_suspect(*driver, *ours, mesh, rays, 1);
            ASSERT_EQ(judged.counts.rays, rays.size());
            for (std::size_t i = 0; i < kFaultCount; ++i) sum.faults[i] += judged.counts.faults[i];
            for (const Finding& finding : judged.findings) {
                // By all triangles, without the tree.
                const Truth truth = referee.closest_of_all(rays[finding.ray]);
                EXPECT_EQ(truth, finding.truth);
                if (finding.fault == Fault::kLost || finding.fault == Fault::kInvented) {
                    EXPECT_EQ(truth.hit(), finding.fault == Fault::kLost);
                }
                if (!reproduced.insert(finding.fault).second) continue;
                const auto part = shrink(*driver, *ours, mesh, rays[finding.ray], finding, [] {});
                if (part) {
                    EXPECT_LE(part->topology.triangles.size(), scene.topology.triangles.size());
                    RecordProperty(name_of(finding.fault), text_of(*part, scene.name, ""));
                } else {
                    reproduced.erase(finding.fault);
                }
                hold();
            }
        }
    }
    EXPECT_GE(images, kImages);
    // Whatever else a driver does, its answers are about triangles of the mesh, each once, and
    // agree with each other.
    EXPECT_EQ(sum[Fault::kBadAnswer], 0u);
    EXPECT_EQ(sum[Fault::kRepeated], 0u);
    EXPECT_EQ(sum[Fault::kAnyHit], 0u);
    for (std::size_t i = 0; i < kFaultCount; ++i)
        RecordProperty(std::string("count of ") + name_of(static_cast<Fault>(i)),
                       std::to_string(sum.faults[i]));
}

}  // namespace
}  // namespace mray::test
