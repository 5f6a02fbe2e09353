// Compares variants with brute force, bit for bit.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/update/tree_updater.h"
#include "tests/fuzz/case/fuzz_case.h"
#include "tests/fuzz/judge/variants.h"
#include "tools/image/compare.h"

namespace mray::fuzz {

/// A variant's difference from the reference in an image or in a batch of single rays.
struct Finding {
    const Variant* variant = nullptr;
    /// The difference of an image.
    FrameDifference image;
    /// The number of single rays that differ, and the first of them; in their closest or any hits.
    bool is_any_hit = false;
    std::size_t ray_count = 0;
    std::size_t ray_index = 0;
    Hit expected = no_hit();
    Hit actual = no_hit();

    bool is_image() const { return ray_count == 0; }
};

/// Variant, kind of difference, and the first pixel or ray with both values, floats as bits.
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
    std::uint64_t failed_cases = 0;
    std::uint64_t failed_images = 0;

    void add(const Tally& other);
};

/// Holds one scene at a time for some variants and the reference, which must outlive it.
class Referee {
public:
    explicit Referee(Backend& reference) : reference_(reference) {}

    /// The scene for what follows. Each variant gets its tree when it is its turn, and keeps it
    /// until another one takes its backend.
    void load(std::unique_ptr<FuzzScene> scene, std::span<const Variant> variants);
    /// Compares images of the scene. Throws Error for a view that is refused.
    std::vector<Finding> compare_images(const ViewSpec& view, Tally& tally);
    /// Compares closest hits of single rays, on the CPU also any hits; leaves out invalid rays. The
    /// first rays are traced among others that nearly have their direction, so that streams of rays
    /// go down the tree together.
    std::vector<Finding> compare_rays(std::span<const WorldRay> rays, Tally& tally);

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
    std::unique_ptr<FuzzScene> scene_;
    std::span<const Variant> variants_;
    std::map<Backend*, Loaded> loaded_;
    Frame expected_;
    Frame actual_;
};

/// Compares a whole case: its image if it has one, and its rays. Counts a refused view.
std::vector<Finding> check_case(Referee& referee, const FuzzCase& fuzz_case,
                                std::span<const Variant> variants, Tally& tally);

/// The rays of a case, and each of those that hit again with tnear and with tfar at its hit and at
/// the floats next to it.
std::vector<WorldRay> with_ends_at_hits(Backend& brute, const FuzzCase& fuzz_case);

}  // namespace mray::fuzz
