// Whether entrants answer as brute force does, bit for bit.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/image/compare.h"
#include "common/update/tree_updater.h"
#include "tests/fuzz/case/fuzz_case.h"
#include "tests/fuzz/judge/entrants.h"

namespace morphray::fuzz {

/// An entrant's difference to the reference in an image or in a batch of single rays.
struct Finding {
    const Entrant* entrant = nullptr;
    /// Of an image.
    FrameDifference image;
    /// Of single rays: how many differ, and the first.
    std::size_t ray_count = 0;
    std::size_t ray_index = 0;
    Hit expected = no_hit();
    Hit actual = no_hit();

    bool is_image() const { return ray_count == 0; }
};

/// Entrant, kind of difference, and the first pixel or ray with both values, floats as bits.
std::string describe(const Finding& finding);

/// What has been compared.
struct Tally {
    std::uint64_t cases = 0;
    /// Cases that no image can be made of, for example as eye and target coincide.
    std::uint64_t refused = 0;
    /// Comparisons of an entrant's image with the reference; those with the eye within 2^-20
    /// extents of the plane of a triangle.
    std::uint64_t images = 0;
    std::uint64_t images_near_a_plane = 0;
    /// Rays of entrants, secondary ones included.
    std::uint64_t rays = 0;
    std::uint64_t failed_cases = 0;
    std::uint64_t failed_images = 0;

    void add(const Tally& other);
};

/// Holds one scene at a time for some entrants and the reference. They must outlive it.
class Referee {
public:
    explicit Referee(Backend& reference) : reference_(reference) {}

    /// The scene for what follows. Each entrant gets its tree when it is its turn, and keeps it
    /// until another one takes its backend.
    void load(std::unique_ptr<FuzzScene> scene, std::span<const Entrant> entrants);
    /// Compares images of the scene. Throws Error for a view that is refused.
    std::vector<Finding> compare_images(const ViewSpec& view, Tally& tally);
    /// Compares closest hits of single rays; those that are none are left out.
    std::vector<Finding> compare_rays(std::span<const WorldRay> rays, Tally& tally);

private:
    /// What a backend holds.
    struct Loaded {
        const Entrant* entrant = nullptr;
        /// Background builds read the scene, so it ends before that.
        std::unique_ptr<TreeUpdater> updater;
    };

    void prepare(const Entrant& entrant);
    std::unique_ptr<TreeUpdater> travel(Backend& backend);

    Backend& reference_;
    std::unique_ptr<FuzzScene> scene_;
    std::span<const Entrant> entrants_;
    std::map<Backend*, Loaded> loaded_;
    Frame expected_;
    Frame actual_;
};

/// A whole case: its image if it has one, and its rays. A refused view counts as such.
std::vector<Finding> check_case(Referee& referee, const FuzzCase& fuzz_case,
                                std::span<const Entrant> entrants, Tally& tally);

/// The rays of a case, and each of those that hit again with tnear and with tfar at its hit and at
/// the floats next to it.
std::vector<WorldRay> with_ends_at_hits(Backend& brute, const FuzzCase& fuzz_case);

}  // namespace morphray::fuzz
