// Compares every backend over every kind of tree with a reference.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/base/options.h"
#include "app/report/crosscheck/check_report.h"
#include "app/terminal/messages.h"
#include "common/backend.h"
#include "scenes/scene_frames.h"

namespace mray::app {

/// Whether brute force takes at most 2e9 ray-triangle tests a frame.
bool brute_is_affordable(std::uint64_t triangles, const ViewSpec& view, std::uint32_t rays);

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

/// Two instances of a backend and the tree that one of them refits.
struct BackendPair {
    std::unique_ptr<Backend> refits;
    std::unique_ptr<Backend> given;
    Bvh tree;
};

/// The backends of a run, which the scenes share, because a device takes a second to start.
struct CheckedBackends {
    /// Without SIMD.
    BackendPair cpu;
    std::optional<BackendPair> vulkan;
    std::unique_ptr<Backend> brute;
};

CheckedBackends make_checked_backends(const BackendOptions& options, const Messages& messages);

/// Two instances of each backend: one refits its own tree from frame to frame, the other is given
/// trees that the other backend refitted and one built for the frame. Each instruction set of the
/// CPU traces the tree that the CPU refitted and the new one.
class CrossChecker {
public:
    /// Builds at the first of the report's frames. Compares only the CPU without a device.
    CrossChecker(const CrosscheckOptions& options, SceneFrames& scene, CheckedBackends& backends,
                 Json& report);

    /// Compares one frame for every kind of rays, and adds each comparison to the report.
    void check(double frame, Progress& progress);

private:
    struct Expected {
        std::uint32_t rays;
        Frame frame;
        std::string reference;
    };
    void trace_reference(std::span<const vec3> positions, const Bvh& rebuilt);
    void query_reference(std::span<const vec3> positions);
    /// `simd` is the backend's instruction set, or ""; `refit_on` what refitted its tree, or "".
    void compare(Backend& backend, const std::string& simd, const std::string& refit_on);
    void check_vulkan(std::span<const vec3> positions, const Bvh& rebuilt);
    void check_cpu(std::span<const vec3> positions, const Bvh& rebuilt);
    void check_simd(const std::string& simd, std::span<const vec3> positions, const Bvh& rebuilt);
    bool uses_brute(std::uint32_t rays) const;
    bool queries_use_brute() const;
    /// Otherwise the CPU only refits and traces the reference.
    bool checks_cpu() const;
    void refit(BackendPair& pair, std::span<const vec3> positions);
    ImageParams params_for(std::uint32_t rays) const;

    const CrosscheckOptions& options_;
    SceneFrames& scene_;
    CheckedBackends& backends_;
    Json& report_;
    std::vector<std::uint32_t> rays_;
    std::vector<std::string> simd_;
    /// These belong to the frame that is being checked.
    double frame_ = 0;
    Progress* progress_ = nullptr;
    std::vector<Expected> expected_;
    CheckBatch batch_;
    Answers expected_answers_;
};

}  // namespace mray::app
