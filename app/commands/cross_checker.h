// Compares every backend over every kind of tree with a reference.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/animation/animation_scene.h"
#include "app/base/messages.h"
#include "app/base/options.h"
#include "app/report/check_report.h"
#include "common/backend.h"
#include "library/src/engine.h"

namespace mray::app {

namespace engine = morphray::engine;

/// Whether brute force takes at most 2e9 ray-triangle tests a frame.
bool brute_is_affordable(std::uint64_t triangles, const morphray::View& view, morphray::Rays rays);

/// The instruction sets that are compared for --simd: all that this machine has, one, or none.
std::vector<std::string> simd_to_check(const std::string& simd);

/// Rays and points in scene space, as many of the one as of the other.
struct CheckBatch {
    std::vector<Ray> rays;
    std::vector<vec3> points;
};

/// The same queries on every machine, around the mesh, its vertices, edges and triangles.
CheckBatch pseudo_random_batch(const Topology& topology, std::span<const vec3> positions,
                               std::uint32_t count);

struct Answers {
    /// For Crossing::kEach and kOwner.
    std::array<HitLists, 2> hits;
    std::vector<FloatWinding> windings;
    /// Ascending.
    std::vector<UncertainCrossing> uncertain;
    std::vector<ClosestTriangle> closest;
};

Answers answers_of(Backend& backend, const CheckBatch& batch);

/// Counts the rays and points with other answers, bit by bit.
QueryDifference compare_answers(const Answers& expected, const Answers& actual);

struct CheckedDevices {
    std::optional<morphray::Device> vulkan;
    /// Without SIMD.
    morphray::Device cpu;
    morphray::Device brute;
    /// The CPU with each of the instruction sets; none if only Vulkan is checked.
    std::vector<std::pair<std::string, morphray::Device>> simd;
};

CheckedDevices open_checked_devices(const BackendOptions& options, const Messages& messages);

/// Two instances of each backend: one refits its own tree from frame to frame, the other is given
/// trees that the other backend refitted and one built for the frame. Each instruction set of the
/// CPU traces the tree that the CPU refitted and the new one.
class CrossChecker {
public:
    /// Builds at the first of the report's frames. Compares only the CPU without a device.
    CrossChecker(const CrosscheckOptions& options, const Animation& animation,
                 const CheckedDevices& devices, Json& report, const Messages& messages);

    /// Compares one frame for every kind of rays, and adds each comparison to the report.
    void check(double frame, Progress& progress);

private:
    struct Expected {
        morphray::Rays rays;
        Frame frame;
        std::string reference;
    };
    void trace_reference();
    void query_reference();
    /// `simd` is the backend's instruction set, or ""; `refit_on` what refitted its tree, or "".
    void compare(Backend& backend, const std::string& simd, const std::string& refit_on);
    void check_vulkan();
    void check_cpu();
    bool uses_brute(morphray::Rays rays) const;
    bool queries_use_brute() const;
    /// Otherwise the CPU only refits and traces the reference.
    bool checks_cpu() const;
    ImageParams params_for(morphray::Rays rays) const;
    std::span<const vec3> positions() const { return engine::positions(scene_.scene()); }

    const CrosscheckOptions& options_;
    const Topology& topology_;
    const CheckedDevices& devices_;
    Json& report_;
    morphray::View view_;
    std::vector<morphray::Rays> rays_;
    /// Its backend refits the CPU's tree; the others have copies.
    AnimationScene scene_;
    std::unique_ptr<Backend> cpu_given_;
    std::unique_ptr<Backend> brute_;
    std::unique_ptr<Backend> vulkan_refits_;
    std::unique_ptr<Backend> vulkan_given_;
    /// These belong to the frame that is being checked.
    double frame_ = 0;
    Bvh cpu_tree_;
    Bvh vulkan_tree_;
    Bvh rebuilt_;
    Progress* progress_ = nullptr;
    std::vector<Expected> expected_;
    CheckBatch batch_;
    Answers expected_answers_;
};

}  // namespace mray::app
