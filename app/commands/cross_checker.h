// Every backend, over every kind of tree, against a reference.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/cli/options.h"
#include "app/report/reports.h"
#include "app/terminal/messages.h"
#include "common/backend.h"
#include "common/scene/scene_frames.h"

namespace morphray::app {

/// Whether brute force is a reference that one can wait for: about 2e9 ray-triangle tests a frame.
bool brute_is_affordable(std::uint64_t triangles, const ViewSpec& view, std::uint32_t rays);

/// Holds two instances of each backend, the CPU without SIMD. One refits its own tree from frame to
/// frame and traces that; the other is given trees: the one that the other backend refitted, and
/// one that is built for the frame. A tree refitted on a device is read back for that. The CPU's
/// instruction sets take turns over the tree that the CPU refitted and the one built for the frame.
class CrossChecker {
public:
    /// Receives each comparison as it is made.
    using OnRow = std::function<void(const CheckRow&, const Frame& expected, const Frame& actual)>;

    /// Builds at options.tree.build_at or at `first_frame`. Without `with_vulkan` only the CPU is
    /// checked, and with the backend kVulkan only that. Throws what clip, builder and backends
    /// throw.
    CrossChecker(const Options& options, SceneFrames& scene, double first_frame, bool with_vulkan,
                 const Messages& messages);

    /// Compares one frame for every kind of `rays`. Returns the trees' hashes.
    TreeRow check(double frame, const std::vector<std::uint32_t>& rays, const OnRow& on_row);

    /// Comparisons that check() makes of a frame for a kind of rays.
    std::size_t variant_count(std::uint32_t rays) const;
    /// What the device is, empty without one.
    std::string device() const;

private:
    struct Pair {
        std::unique_ptr<Backend> refits;
        std::unique_ptr<Backend> given;
        Bvh tree;  // as refitted by `refits`
    };
    struct Expected {
        std::uint32_t rays;
        Frame frame;
        const char* reference;
    };
    struct Variant {
        Backend* backend;
        /// The instruction set, or "".
        std::string simd;
        const char* update;
        const char* refit_on;
    };

    void trace_reference(std::span<const vec3> positions, const Bvh& rebuilt,
                         const std::vector<std::uint32_t>& rays);
    void compare_variant(const Variant& variant, double frame, const OnRow& on_row);
    void check_pair(Pair& pair, const Pair& other, std::span<const vec3> positions,
                    const Bvh& rebuilt, double frame, const OnRow& on_row);
    void check_simd(const std::string& simd, std::span<const vec3> positions, const Bvh& rebuilt,
                    double frame, const OnRow& on_row);
    bool uses_brute(std::uint32_t rays) const;
    /// Whether the CPU's images are compared, or only make the reference and refit.
    bool checks_cpu() const;
    void refit(Pair& pair, std::span<const vec3> positions);
    ImageParams params_for(std::uint32_t rays) const;

    const Options& options_;
    SceneFrames& scene_;
    ImageParams params_;
    /// Instruction sets to check.
    std::vector<std::string> simd_;
    Pair cpu_;
    Pair vulkan_;
    std::unique_ptr<Backend> brute_;
    std::vector<Expected> expected_;
};

}  // namespace morphray::app
