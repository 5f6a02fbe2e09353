#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

#include "common/base/errors.h"
#include "common/interop/arithmetic.h"
#include "common/scene_queries.h"
#include "tests/fuzz/judge/judge.h"
#include "tests/support/same_bits.h"

namespace mray::fuzz {
namespace {

bool same(const Frame& a, const Frame& b) {
    return test::same_bytes(a.hits, b.hits) && test::same_bytes(a.occlusion, b.occlusion) &&
           test::same_bytes(a.pixels, b.pixels);
}

/// Runs some builds in the background and decides the same in every run.
UpdateConfig auto_config() { return {.deterministic = true, .budget = 0.02}; }

// Rays that are traced among others.
constexpr std::size_t kCrowdedRays = 16;
// The others of each of them: more than go on alone on any target.
constexpr std::uint32_t kCrowd = 15;

/// Adds rays that are equal to this one or nearly have its direction.
void add_crowd(const Ray& ray, std::vector<Ray>& rays) {
    for (std::uint32_t k = 0; k < kCrowd; ++k) {
        Ray other = ray;
        const float sign = (k & 1) != 0 ? -1.0f : 1.0f;
        if (k % 4 != 0) other.dir[k % 3] += std::ldexp(sign, -3 * static_cast<int>(k));
        other.dir = canonical_direction(other.dir);
        rays.push_back(largest_component(other.dir) > 0 ? other : ray);
    }
}

std::vector<std::uint8_t> any_hits(Backend& backend, std::span<const Ray> rays) {
    std::vector<std::uint8_t> occluded(rays.size());
    backend.trace({rays, {}, occluded});
    return occluded;
}

void add(std::vector<Finding>& findings, const Variant& variant,
         const std::vector<AnswerDifference>& differences) {
    for (const AnswerDifference& difference : differences)
        findings.push_back({&variant, {}, difference});
}

/// The rays for which `differs(i)`.
template <class Differs>
std::vector<AnswerDifference> find_differences(Asked asked, std::span<const std::size_t> indices,
                                               Differs differs) {
    AnswerDifferences found;
    for (std::size_t i = 0; i < indices.size(); ++i)
        if (differs(i)) found.add(asked, indices[i]);
    return found.all();
}

}  // namespace

std::string describe(const Finding& finding) {
    const std::string text = finding.variant->name() + ": ";
    if (finding.is_image()) {
        const PixelDifference& p = finding.image.first.front();
        return text + fmt::format("{}; pixel {},{}", describe(finding.image), p.x, p.y);
    }
    const AnswerDifference& a = finding.answer;
    const char* const thing = finding.is_about_points() ? "point" : "ray";
    return text + fmt::format("{} of {} {}s differ; {} {}", name_of(a.asked), a.count, thing, thing,
                              a.index);
}

void Referee::load(std::unique_ptr<FuzzScene> scene, std::span<const Variant> variants) {
    loaded_.clear();
    scene_ = std::move(scene);
    variants_ = variants;
    reference_.set_scene(scene_->topology, scene_->positions(), scene_->rebuilt);
}

void Referee::prepare(const Variant& variant) {
    Backend& backend = *variant.backend;
    Loaded& loaded = loaded_[&backend];
    if (loaded.variant == &variant) return;
    loaded.updater.reset();
    loaded.variant = &variant;
    if (variant.tree == TreeKind::kAuto) {
        loaded.updater = travel(backend);
    } else if (variant.tree == TreeKind::kRebuilt) {
        backend.set_scene(scene_->topology, scene_->positions(), scene_->rebuilt);
    } else {
        backend.set_scene(scene_->topology, scene_->journey.front(), scene_->built);
        backend.refit(scene_->positions());
    }
}

std::unique_ptr<TreeUpdater> Referee::travel(Backend& backend) {
    const auto& journey = scene_->journey;
    auto updater =
        std::make_unique<TreeUpdater>(scene_->topology, journey.front(), backend,
                                      make_update_policy({PolicyKind::kAuto}, auto_config()),
                                      BuildConfig{.threads = 1}, auto_config());
    for (const auto& positions : journey) {
        if (&positions != &journey.front()) updater->update(positions);
        // The policy needs the cost of a frame, which counts rays.
        updater->frame_done({.rays = 1});
    }
    return updater;
}

std::vector<Finding> Referee::compare_images(const ViewSpec& view, Tally& tally) {
    const ImageParams params = make_image_params(view, scene_->bounds, scene_->space);
    reference_.trace_image(params, expected_);
    std::vector<Finding> findings;
    for (const Variant& variant : variants_) {
        prepare(variant);
        variant.backend->trace_image(params, actual_);
        tally.rays += variant.backend->finish().rays;
        if (same(expected_, actual_)) continue;
        findings.push_back({&variant, compare_frames(expected_, actual_), {}});
    }
    return findings;
}

std::vector<Finding> Referee::compare_rays(std::span<const WorldRay> world_rays, Tally& tally) {
    std::vector<Ray> rays;
    std::vector<std::size_t> indices;
    for (std::size_t i = 0; i < world_rays.size(); ++i) {
        const SceneRay ray = to_scene(scene_->space, world_rays[i]);
        if (!ray.valid) continue;
        rays.push_back(ray.ray);
        if (i < kCrowdedRays) add_crowd(ray.ray, rays);
        indices.resize(rays.size(), i);
    }
    if (rays.empty()) return {};
    std::vector<Hit> expected(rays.size());
    std::vector<Hit> actual(rays.size());
    reference_.trace({rays, expected});
    std::vector<Finding> findings;
    for (const Variant& variant : variants_) {
        prepare(variant);
        variant.backend->trace({rays, actual});
        tally.rays += rays.size();
        add(findings, variant, find_differences(Asked::kClosestHits, indices, [&](std::size_t i) {
                return !test::same_bits(expected[i], actual[i]);
            }));
        if (!variant.backend->info().answers_threads) continue;
        const std::vector<std::uint8_t> occluded = any_hits(*variant.backend, rays);
        add(findings, variant, find_differences(Asked::kAnyHits, indices, [&](std::size_t i) {
                return (occluded[i] != 0) != (expected[i].prim_id != kNoPrim);
            }));
    }
    return findings;
}

std::vector<Finding> Referee::compare_questions(const FuzzCase& fuzz_case) {
    const CaseQueries queries(*scene_, fuzz_case, test::queries_of(reference_));
    std::vector<Finding> findings;
    for (const Variant& variant : variants_) {
        prepare(variant);
        add(findings, variant, queries.compare(test::queries_of(*variant.backend)));
    }
    add(findings, world_, check_world(fuzz_case));
    return findings;
}

std::vector<Finding> check_case(Referee& referee, const FuzzCase& fuzz_case,
                                std::span<const Variant> variants, Tally& tally) {
    ++tally.cases;
    std::vector<Finding> findings;
    referee.load(std::make_unique<FuzzScene>(fuzz_case), variants);
    if (fuzz_case.has_image()) {
        try {
            findings = referee.compare_images(fuzz_case.view, tally);
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::kBadInput) throw;
            ++tally.refused;
        }
    }
    std::ranges::move(referee.compare_rays(fuzz_case.rays, tally), std::back_inserter(findings));
    if (fuzz_case.asks_questions)
        std::ranges::move(referee.compare_questions(fuzz_case), std::back_inserter(findings));
    tally.failed_cases += findings.empty() ? 0 : 1;
    return findings;
}

std::vector<WorldRay> with_ends_at_hits(Backend& brute, const FuzzCase& fuzz_case) {
    constexpr std::uint32_t kMostHits = 16;
    const FuzzScene scene(fuzz_case);
    brute.set_scene(scene.topology, scene.positions(), scene.rebuilt);
    std::vector<WorldRay> all = fuzz_case.rays;
    for (const WorldRay& world : fuzz_case.rays) {
        const SceneRay ray = to_scene(scene.space, world);
        if (!ray.valid) continue;
        HitLists lists;
        brute.query(ListQuery{{&ray.ray, 1}, Crossing::kEach, kMostHits, lists});
        if (lists.hits.empty()) continue;
        // Questions are asked about all hits.
        const Hit hit = lists.hits[fuzz_case.asks_questions ? all.size() % lists.hits.size() : 0];
        const float t[] = {hit.t, std::nextafter(hit.t, 0.0f), std::nextafter(hit.t, kInfiniteT)};
        for (const float end : t) {
            const double world_t = std::ldexp(static_cast<double>(end), ray.t_exponent);
            WorldRay bounded = world;
            bounded.tnear = world_t;
            bounded.tfar = std::max(world.tfar, world_t);
            all.push_back(bounded);
            bounded.tnear = std::min(world.tnear, world_t);
            bounded.tfar = world_t;
            all.push_back(bounded);
        }
    }
    return all;
}

}  // namespace mray::fuzz
