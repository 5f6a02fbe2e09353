// The device gives the answers of the CPU, bit for bit. The oracle is brute force, which shares the
// hit rule with the device, but no tree, order or batching.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>

#include "common/image/frame.h"
#include "cpu/cpu_backend.h"
#include "cpu/reference/scalar_tracer.h"
#include "tests/gpu/faulty_loader.h"
#include "tests/gpu/test_scenes.h"
#include "tests/support/late_boxes.h"
#include "tests/support/query_answers.h"
#include "tests/support/same_bits.h"

namespace mray::test {
namespace {

std::size_t differing(const Frame& a, const Frame& b) {
    std::size_t count = a.width != b.width || a.height != b.height;
    for (std::size_t i = 0; i < a.hits.size(); ++i) {
        count += !same_bits(a.hits[i], b.hits[i]) || a.occlusion[i] != b.occlusion[i] ||
                 a.pixels[i] != b.pixels[i];
    }
    return count;
}

/// Compares images of a scene. `refits` also lets both backends refit all of it.
void expect_same_images(Backend& expected, Backend& actual, const std::string& name,
                        const TestScene& scene, const Bvh& bvh,
                        const std::vector<ImageParams>& views, bool refits = false) {
    for (Backend* backend : {&expected, &actual}) {
        set_scene(*backend, scene, bvh);
        if (refits) backend->refit(RefitExtent::kAll);
    }
    for (const ImageParams& params : views) {
        SCOPED_TRACE(testing::Message()
                     << name << ", rays " << params.rays << ", " << params.ao_count << " a hit");
        Frame frame, traced;
        expected.trace_image(params, frame);
        actual.trace_image(params, traced);
        EXPECT_EQ(differing(frame, traced), 0u);
        EXPECT_EQ(expected.finish().rays, actual.finish().rays);
    }
}

/// The same triangle `count` times, so that no box can be culled.
TestScene coincident(std::uint32_t count) {
    return {{{-3, -2, 0}, {3, -2, 0}, {0, 3, 0}}, std::vector<uvec3>(count, {0, 1, 2})};
}

std::vector<NamedScene> some_scenes() {
    std::vector<NamedScene> scenes = adversarial_scenes();
    std::erase_if(scenes, [](const NamedScene& named) {
        constexpr const char* kNames[] = {"slivers",     "large soup",  "coplanar",   "mixed sizes",
                                          "0 triangles", "1 triangles", "not finite", "torus"};
        return std::ranges::find(kNames, named.name) == std::end(kNames);
    });
    return scenes;
}

TEST(OnePicture, ImagesEqualBruteForceHoweverTheyAreDividedAndCopied) {
    using enum gpu::BufferKind;
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    const std::vector<NamedScene> scenes = some_scenes();
    Faults least_limits;
    least_limits.edit_properties = set_least_limits;
    const FaultyLoader least(least_limits);
    for (const auto& [tuning, width, height] :
         std::initializer_list<std::tuple<gpu::Tuning, std::uint32_t, std::uint32_t>>{
             {{.buffer_kind = kTexels}, 77, 53},
             {{.buffer_kind = kStorage}, 77, 53},
             {{.tiles_per_dispatch = 3}, 61, 43},
             // Rays are suspended at each step, or some are.
             {{.step_budget = 1, .resume_slots = 128}, 31, 23},
             {{.step_budget = 60, .buffer_kind = kTexels}, 61, 43},
             {{.step_budget = 60, .buffer_kind = kStorage}, 61, 43},
             {{.force_staging = true}, 61, 43},
             {{.loader = least.get()}, 61, 43}}) {
        const std::unique_ptr<Backend> vulkan = validated_device(tuning);
        for (const NamedScene& named : scenes) {
            expect_same_images(*brute, *vulkan, named.name, named.scene, loose_tree(named.scene),
                               {view(width, height, kRaysPrimary), view(width, height, kRaysShadow),
                                view(width, height, kRaysAo)});
        }
    }
}

// Rays are suspended, and views are divided into several submissions. Without the triangle a miss
// has an infinite t.
TEST(OnePicture, ViewsHaveTheNeededWordsOfHits) {
    const TestScene scene = torus(32, 16);
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    set_scene(*brute, scene, built_tree(scene));
    ViewBatch views;
    views.params = view(45, 31, kRaysPrimary);
    std::vector<Camera> cameras(3, views.params.camera);
    std::vector<Frame> frames(cameras.size());
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        cameras[i].org.x += static_cast<float>(i) * 0.1f * kSceneExtent;
        views.params.camera = cameras[i];
        brute->trace_image(views.params, frames[i]);
    }
    views.cameras = cameras;
    std::size_t wrong = 0, pixels = 0;
    views.take = [&](std::span<const TracedTile> tiles) {
        for (const TracedTile& tile : tiles) {
            EXPECT_EQ(tile.hit_words & views.hit_words, views.hit_words);
            const auto step = static_cast<std::size_t>(std::popcount(tile.hit_words));
            for (std::uint32_t y = tile.y0; y < tile.y1; ++y) {
                for (std::uint32_t x = tile.x0; x < tile.x1; ++x, ++pixels) {
                    const std::size_t from = (y - tile.y0) * tile.stride + (x - tile.x0);
                    const std::size_t i = std::size_t{y} * views.params.width + x;
                    const Hit& hit = frames[tile.view].hits[i];
                    auto expected = std::bit_cast<std::array<std::uint32_t, 4>>(hit);
                    if (hit.prim_id == kNoPrim && tile.hit_words != kWholeHit)
                        expected[0] = std::bit_cast<std::uint32_t>(INFINITY);
                    const auto* word = static_cast<const std::uint32_t*>(tile.hits) + from * step;
                    for (std::uint32_t k = 0; k < 4; ++k)
                        if ((tile.hit_words >> k & 1) != 0) wrong += *word++ != expected[k];
                    if (views.with_pixels)
                        wrong += tile.pixels[from] != frames[tile.view].pixels[i];
                }
            }
        }
    };
    for (const gpu::Tuning& tuning :
         {gpu::Tuning{}, gpu::Tuning{.force_staging = true},
          gpu::Tuning{.step_budget = 60, .tiles_per_dispatch = 3, .force_staging = true}}) {
        const std::unique_ptr<Backend> vulkan = validated_device(tuning);
        set_scene(*vulkan, scene, built_tree(scene));
        for (std::uint32_t words = 0; words <= kWholeHit; ++words) {
            views.hit_words = words;
            views.with_pixels = words % 3 == 0;
            pixels = 0;
            vulkan->trace_views(views);
            EXPECT_EQ(pixels, 3u * 45 * 31);
        }
    }
    EXPECT_EQ(wrong, 0u);
}

// Surfaces that hide each other, in one submission and in batches that end between the rays of a
// pixel.
TEST(OnePicture, AnyNumberOfOcclusionRaysGivesTheImageOfBruteForce) {
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    std::vector<ImageParams> views;
    for (const std::uint32_t count : {1u, 2u, 3u, 7u, 37u})
        views.push_back(view(40, 30, kRaysAo, count));
    for (const std::uint32_t tiles : {30u, 4096u}) {
        const std::unique_ptr<Backend> vulkan = validated_device({.tiles_per_dispatch = tiles});
        for (const TestScene& scene : {torus(32, 16), random_soup(700, 0.3, 9)})
            expect_same_images(*brute, *vulkan, "", scene, built_tree(scene), views);
    }
}

// Rays so close to edges that most of them need the exact rule.
TEST(OnePicture, RaysThatMeetEdgesEqualTheCpu) {
    const std::unique_ptr<Backend> vulkan = validated_device();
    const std::unique_ptr<Backend> cpu = cpu::make_scalar_backend();
    Random random(3);
    for (const TestScene& scene :
         {TestScene(shapes::needles(random, 20000)), TestScene(shapes::slivers(random, 20000))}) {
        expect_same_images(*cpu, *vulkan, "", scene, built_tree(scene),
                           {view(128, 96, kRaysShadow), view(128, 96, kRaysAo, 31)});
    }
}

// The worst trees after deformation, with the default budget: each ray meets every triangle, which
// takes more steps than a lane has. Then each leaf is full, and each of its triangles uncertain, so
// that a leaf takes the most steps; the rounds that continue a ray are limited by their number.
TEST(OnePicture, ImagesOfTreesThatCannotBeCulledEqualBruteForce) {
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    const std::unique_ptr<Backend> vulkan = validated_device();
    for (const TestScene& scene : {coincident(5000), torus(64, 32)}) {
        expect_same_images(*brute, *vulkan, "", scene, loose_tree(scene),
                           {view(48, 32, kRaysShadow)}, true);
    }
    const TestScene scene = coincident(8192);
    expect_same_images(*brute, *validated_device({.step_budget = 100}), "", scene,
                       built_tree(scene), {view(8, 6, kRaysPrimary)});
}

void expect_same_hits(Backend& expected, Backend& actual, std::span<const Ray> rays) {
    std::vector<Hit> hits(rays.size()), traced(rays.size());
    expected.trace({rays, hits});
    actual.trace({rays, traced});
    for (std::size_t i = 0; i < rays.size(); ++i) ASSERT_TRUE(same_bits(hits[i], traced[i])) << i;
    EXPECT_EQ(actual.finish().rays, rays.size());
}

TEST(OnePicture, BatchesOfRaysEqualBruteForce) {
    const std::unique_ptr<Backend> vulkan = validated_device({.tiles_per_dispatch = 16});
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    for (const NamedScene& named : adversarial_scenes()) {
        SCOPED_TRACE(named.name);
        const Bvh bvh = loose_tree(named.scene);
        for (Backend* backend : {vulkan.get(), brute.get()}) set_scene(*backend, named.scene, bvh);
        expect_same_hits(*brute, *vulkan, mixed_rays(named.scene, 2000, 7));
    }
}

// Rays go on into boxes that begin within the depth margin behind the closest hit so far.
TEST(OnePicture, LateBoxesAreEntered) {
    const std::unique_ptr<Backend> vulkan = validated_device();
    const std::unique_ptr<Backend> brute = cpu::make_brute_backend();
    const LateBoxes scene = late_boxes(63);
    const Pose pose(scene.positions);
    for (Backend* backend : {vulkan.get(), brute.get()})
        backend->set_scene(scene.topology, pose, scene.bvh);
    expect_same_hits(*brute, *vulkan, rays_at_late_boxes(1000));
}

constexpr std::uint32_t kAllHits = std::numeric_limits<std::uint32_t>::max();

/// `size` is the number of rays and of points a scene, `only` its name, or empty for all scenes.
void compare_with_brute_force(gpu::Tuning tuning, std::size_t size, const std::string& only = {}) {
    tuning.resume_slots = 64;
    const std::unique_ptr<Backend> device = validated_device(tuning);
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        if (!only.empty() && named.name != only) continue;
        const cpu::BruteTracer brute(scene.topology(), scene.positions());
        set_scene(*device, scene, built_tree(scene));
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

TEST(DeviceQueries, HaveTheBitsOfBruteForceInOnePartOrMany) {
    compare_with_brute_force({}, 150);
    compare_with_brute_force({.buffer_kind = gpu::BufferKind::kStorage}, 50);
    // Suspended all the time; then 256 at a time, with room for 128 uncertain crossings.
    compare_with_brute_force({.step_budget = 150}, 8);
    for (const char* const scene : {"star", "grid box", "slivers"})
        compare_with_brute_force({.tiles_per_dispatch = 4}, 700, scene);
}

}  // namespace
}  // namespace mray::test
