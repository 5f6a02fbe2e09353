// Compares variants of tracers and trees with brute force, bit for bit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/backend.h"
#include "common/update/tree_updater.h"
#include "report/compare.h"
#include "tests/fuzz/case.h"
#include "tests/support/query_answers.h"

namespace mray::fuzz {

/// How a variant's tree is made for the pose that is traced.
enum class TreeKind {
    kRefitted,  // built at another pose, refitted by the variant
    kRebuilt,   // built at the pose
    kAuto,      // updated by the policy "auto" over the poses between
};
/// "refitted", "rebuilt" or "auto".
const char* name_of(TreeKind tree);

/// A backend with a kind of tree. Several may share a backend and take turns.
struct Variant {
    Backend* backend = nullptr;
    /// "cpu avx2, 1 thread" or "vulkan".
    std::string tracer;
    TreeKind tree = TreeKind::kRebuilt;

    std::string name() const;
};

/// The kinds of comparisons.
enum class Asked {
    kImage,
    kClosestHits,
    kAnyHits,
    kHitCounts,
    kAllHits,
    kNextHits,
    kWindings,
    kClosestPoints,
};
/// "closest hits", "windings", ...
const char* name_of(Asked asked);
/// Whether they are of points; otherwise of rays.
bool is_about_points(Asked asked);

/// Rays or points with other answers, and the first of them, by its place in the case.
struct AnswerDifference {
    Asked asked = Asked::kImage;
    std::size_t count = 0;
    std::size_t index = 0;
};

/// Collects differences of answers: one for each kind.
struct AnswerDifferences {
    std::vector<AnswerDifference> all;

    void add(Asked asked, std::size_t index);
};

/// The answers of a scene that has moved to the frame, over a tree of each kind of update. Windings
/// are those of exact integers for all triangles; distances have the sign of inside, and those
/// within a largest distance are all there; lists of hits, their numbers, and steps from hit to hit
/// agree. Everything has the bits of brute force. Points and rays that are not finite have the
/// answers that the interface promises.
std::vector<AnswerDifference> check_world(const FuzzCase& fuzz_case);

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

/// Variant, kind of difference, and the first pixel, ray or point.
std::string describe(const Finding& finding);

/// Counts of comparisons.
struct Tally {
    std::uint64_t cases = 0;
    /// Cases whose view is refused, for example because eye and target coincide.
    std::uint64_t refused = 0;
    /// Rays of variants, secondary ones included.
    std::uint64_t rays = 0;
    std::uint64_t failed_cases = 0;
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
    std::vector<Finding> compare_questions(const FuzzCase& fuzz_case);

private:
    /// The state of a backend.
    struct Loaded {
        const Variant* variant = nullptr;
        /// Of a tree that is not rebuilt.
        Pose pose;
        /// Destroyed before the scene, which background builds read.
        std::unique_ptr<TreeUpdater> updater;
    };

    void prepare(const Variant& variant);
    std::unique_ptr<TreeUpdater> travel(Backend& backend, Pose& pose);

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

}  // namespace mray::fuzz
