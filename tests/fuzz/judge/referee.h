// Compares variants with brute force, bit for bit.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/report/compare.h"
#include "common/update/tree_updater.h"
#include "tests/fuzz/case/fuzz_case.h"
#include "tests/fuzz/judge/question_check.h"
#include "tests/fuzz/judge/variants.h"

namespace mray::fuzz {

/// A variant's difference from the reference in an image, or in answers about single rays or
/// points.
struct Finding {
    const Variant* variant = nullptr;
    /// The difference of an image.
    FrameDifference image;
    /// All others.
    AnswerDifference answer;

    bool is_image() const { return answer.asked == Asked::kImage; }
    bool is_about_points() const { return fuzz::is_about_points(answer.asked); }
};

/// Variant, kind of difference, and the first pixel, ray or point with both values, floats as bits.
std::string describe(const Finding& finding);

/// Counts of comparisons.
struct Tally {
    std::uint64_t cases = 0;
    /// Cases whose view is refused, for example because eye and target coincide.
    std::uint64_t refused = 0;
    /// Comparisons of a variant's image with the reference; those with the eye within 2^-20
    /// extents of the plane of a triangle.
    std::uint64_t images = 0;
    std::uint64_t images_near_a_plane = 0;
    /// Rays of variants, secondary ones included.
    std::uint64_t rays = 0;
    /// Rays and points whose answers to all questions were compared.
    std::uint64_t questions = 0;
    std::uint64_t failed_cases = 0;
    std::uint64_t failed_images = 0;
};

/// Holds one scene at a time for some variants and the reference, which must outlive it.
class Referee {
public:
    explicit Referee(Backend& reference)
        : reference_(reference), world_{&reference, "the public interface", TreeKind::kRebuilt} {}

    /// The scene for what follows. Each variant gets its tree when it is its turn, and keeps it
    /// until another one takes its backend.
    void load(std::unique_ptr<FuzzScene> scene, std::span<const Variant> variants);
    /// Compares images of the scene. Throws Error for a view that is refused.
    std::vector<Finding> compare_images(const ViewSpec& view, Tally& tally);
    /// Compares closest hits of single rays, on the CPU also any hits; leaves out invalid rays. The
    /// first rays are traced among others that nearly have their direction, so that streams of rays
    /// go down the tree together.
    std::vector<Finding> compare_rays(std::span<const WorldRay> rays, Tally& tally);
    /// Compares all other answers about the rays and points of a case, which is that of the scene.
    std::vector<Finding> compare_questions(const FuzzCase& fuzz_case, Tally& tally);

private:
    /// The state of a backend.
    struct Loaded {
        const Variant* variant = nullptr;
        /// Destroyed before the scene, which background builds read.
        std::unique_ptr<TreeUpdater> updater;
    };

    void prepare(const Variant& variant);
    std::unique_ptr<TreeUpdater> travel(Backend& backend);

    Backend& reference_;
    /// Stands for check_world() in findings.
    Variant world_;
    std::unique_ptr<FuzzScene> scene_;
    std::span<const Variant> variants_;
    std::map<Backend*, Loaded> loaded_;
    Frame expected_;
    Frame actual_;
};

/// Compares a whole case: its image if it has one, its rays, and its questions if it asks them.
/// Counts a refused view.
std::vector<Finding> check_case(Referee& referee, const FuzzCase& fuzz_case,
                                std::span<const Variant> variants, Tally& tally);

/// The rays of a case, and each of those that hit again with tnear and with tfar at its hit, or if
/// it asks questions one of its hits, and at the floats next to it.
std::vector<WorldRay> with_ends_at_hits(Backend& brute, const FuzzCase& fuzz_case);

}  // namespace mray::fuzz
