#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

#include "common/base/errors.h"
#include "common/interop/arithmetic.h"
#include "common/scene_queries.h"
#include "tests/fuzz/judge.h"
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
    return found.all;
}

constexpr std::uint32_t kAllOfThem = std::numeric_limits<std::uint32_t>::max();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// One of the cursors at and next to the hits of a ray.
HitCursor cursor_of(std::span<const Hit> hits, std::size_t kind) {
    if (hits.empty()) return kind % 2 == 0 ? HitCursor{} : HitCursor{1.0f, 0};
    const Hit& hit = hits[kind / 8 % hits.size()];
    switch (kind % 8) {
        case 0:
            return {};
        case 1:
            return {std::nextafter(hit.t, kInfinity), hit.prim_id};
        case 2:
            return {std::nextafter(hit.t, -1.0f), hit.prim_id};
        case 3:
            return {hit.t, hit.prim_id + 1};
        case 4:
            return {hit.t, hit.prim_id == 0 ? 0 : hit.prim_id - 1};
        case 5:
            return {hit.t, kNoPrim};
        default:
            return {hit.t, hit.prim_id};
    }
}

Asked asked_of(test::Answered answered) {
    constexpr std::array kAsked = {Asked::kHitCounts, Asked::kAllHits, Asked::kNextHits,
                                   Asked::kWindings, Asked::kClosestPoints};
    return kAsked[static_cast<std::size_t>(answered)];
}

bool sees_some(std::size_t asked, std::uint32_t prim_id) { return (asked + prim_id) % 3 != 0; }

/// Lists of each crossing, lists that are cut and filtered, next hits after hits and after cursors
/// next to them, windings, and closest triangles within any distance, exactly a distance of one of
/// the points, and just less.
class CaseQueries {
public:
    /// Leaves out rays and points that scene space does not take.
    CaseQueries(const FuzzScene& scene, const FuzzCase& fuzz_case, const test::Queries& reference) {
        test::Questions questions;
        for (std::size_t i = 0; i < fuzz_case.rays.size(); ++i) {
            const SceneRay ray = to_scene(scene.space, fuzz_case.rays[i]);
            if (!ray.valid) continue;
            questions.rays.push_back(ray.ray);
            ray_indices_.push_back(i);
        }
        for (std::size_t i = 0; i < fuzz_case.points.size(); ++i) {
            const vec3 world = fuzz_case.points[i];
            if (!std::isfinite(world.x) || !std::isfinite(world.y) || !std::isfinite(world.z))
                continue;
            const vec3 point = scene.space.to_scene(world);
            if (!(largest_component(point) < kOriginExtent)) continue;
            questions.points.push_back(point);
            point_indices_.push_back(i);
        }
        questions.after.resize(questions.rays.size());
        // A distance of one of the points, and just less.
        float reach = kAnyDistance2;
        if (!questions.points.empty()) {
            ClosestTriangle closest;
            const std::size_t middle = questions.points.size() / 2;
            reference(ClosestQuery{{&questions.points[middle], 1}, kAnyDistance2, {&closest, 1}});
            reach = closest.d2;
        }
        const float less = reach > 0 ? std::nextafter(reach, 0.0f) : 0;
        for (const auto& [crossing, most, round_reach] :
             {std::tuple(Crossing::kEach, kAllOfThem, reach),
              {Crossing::kOwner, kAllOfThem, less},
              {Crossing::kOwner, 2u, 0.0f}}) {
            questions.reach = round_reach;
            if (most == 2) questions.filter = {sees_some, {}};
            HitLists lists;
            reference(ListQuery{
                questions.rays, crossing, kAllOfThem, lists, {}, questions.filter_or_null()});
            const auto hits = test::lists_of_rays(lists);
            for (std::size_t i = 0; i < hits.size(); ++i)
                questions.after[i] = cursor_of(hits[i], i + 5 * rounds_.size());
            rounds_.push_back({crossing, most, questions,
                               test::answers_of(reference, questions, crossing, most)});
        }
    }

    std::vector<AnswerDifference> compare(const test::Queries& queries) const {
        AnswerDifferences differences;
        for (const Round& round : rounds_) {
            const test::Answers actual =
                test::answers_of(queries, round.questions, round.crossing, round.most);
            test::visit_differences(
                round.expected, actual, [&](test::Answered kind, std::size_t i) {
                    const Asked asked = asked_of(kind);
                    differences.add(asked,
                                    (is_about_points(asked) ? point_indices_ : ray_indices_)[i]);
                });
        }
        return differences.all;
    }

private:
    struct Round {
        Crossing crossing;
        std::uint32_t most;
        test::Questions questions;
        test::Answers expected;
    };

    std::vector<std::size_t> ray_indices_;
    std::vector<std::size_t> point_indices_;
    std::vector<Round> rounds_;
};

}  // namespace

const char* name_of(Asked asked) {
    constexpr std::array kNames = {"image",    "closest hits", "any hits", "counts of hits",
                                   "all hits", "next hits",    "windings", "closest points"};
    return kNames[static_cast<std::size_t>(asked)];
}

bool is_about_points(Asked asked) {
    return asked == Asked::kWindings || asked == Asked::kClosestPoints;
}

void AnswerDifferences::add(Asked asked, std::size_t index) {
    for (AnswerDifference& difference : all) {
        if (difference.asked != asked) continue;
        ++difference.count;
        return;
    }
    all.push_back({asked, 1, index});
}

const char* name_of(TreeKind tree) {
    if (tree == TreeKind::kAuto) return "auto";
    return tree == TreeKind::kRebuilt ? "rebuilt" : "refitted";
}

std::string Variant::name() const { return fmt::format("{}, {} tree", tracer, name_of(tree)); }

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
    reference_.set_scene(scene_->topology, scene_->pose, scene_->rebuilt);
}

void Referee::prepare(const Variant& variant) {
    Backend& backend = *variant.backend;
    Loaded& loaded = loaded_[&backend];
    if (loaded.variant == &variant) return;
    loaded.updater.reset();
    loaded.variant = &variant;
    loaded.pose = Pose(scene_->journey.front());
    if (variant.tree == TreeKind::kAuto) {
        loaded.updater = travel(backend, loaded.pose);
    } else if (variant.tree == TreeKind::kRebuilt) {
        backend.set_scene(scene_->topology, scene_->pose, scene_->rebuilt);
    } else {
        backend.set_scene(scene_->topology, loaded.pose, scene_->built);
        loaded.pose.move_to(scene_->positions());
        backend.refit();
    }
}

std::unique_ptr<TreeUpdater> Referee::travel(Backend& backend, Pose& pose) {
    const auto& journey = scene_->journey;
    auto updater = std::make_unique<TreeUpdater>(
        scene_->topology, pose, backend, make_update_policy({PolicyKind::kAuto}, auto_config()),
        BuildConfig{.threads = 1}, auto_config());
    for (const auto& positions : journey) {
        if (&positions != &journey.front()) {
            pose.move_to(positions);
            updater->update();
        }
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
        if (variant.backend->info().call_size > 1) continue;
        std::vector<std::uint8_t> occluded(rays.size());
        variant.backend->trace({rays, {}, occluded});
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

}  // namespace mray::fuzz
