// Queries about all triangles on the device, compared with brute force.
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "common/bvh/builder/bvh_builder.h"
#include "cpu/reference/scalar_tracer.h"
#include "gpu/shared_device.h"
#include "tests/gpu/validated_device.h"
#include "tests/support/query_answers.h"

namespace mray::test {
namespace {

constexpr std::uint32_t kAllHits = std::numeric_limits<std::uint32_t>::max();

/// `size` is the number of rays and of points a scene, `only` its name, or empty for all scenes.
void compare_with_brute_force(gpu::Tuning tuning, std::size_t size, const std::string& only = {}) {
    tuning.resume_slots = 64;
    const std::unique_ptr<Backend> device = validated_device(tuning);
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        if (!only.empty() && named.name != only) continue;
        const cpu::BruteTracer brute(scene.topology(), scene.positions());
        device->set_scene(scene.topology(), scene.positions(),
                          build_bvh(scene.topology(), scene.positions()));
        for (const Crossing crossing : {Crossing::kEach, Crossing::kOwner}) {
            const Questions questions = mixed_questions(scene, brute, crossing, size, 7);
            for (const std::uint32_t most : {1u, kAllHits}) {
                if (most == kAllHits && named.name == "repeated")
                    continue;  // thousands of hits a ray
                EXPECT_EQ(
                    count_differences(answers_of(queries_of(*device), questions, crossing, most),
                                      answers_of(brute, questions, crossing, most)),
                    0u)
                    << named.name << ", " << most;
            }
        }
    }
}

TEST(DeviceQueries, HaveTheBitsOfBruteForce) {
    compare_with_brute_force({}, 150);
    compare_with_brute_force({.buffer_kind = gpu::BufferKind::kStorage}, 50);
}

TEST(DeviceQueries, HaveThemWhenTheyAreSuspendedAllTheTime) {
    compare_with_brute_force({.step_budget = 150}, 8);
}

TEST(DeviceQueries, HaveThemWhenTheyAreAskedInManyParts) {
    // 256 at a time, with room for 128 uncertain crossings.
    for (const char* const scene : {"star", "grid box", "slivers"})
        compare_with_brute_force({.tiles_per_dispatch = 4}, 700, scene);
}

}  // namespace
}  // namespace mray::test
