// Compares every backend over every kind of tree with a reference.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/base/options.h"
#include "app/commands/crosscheck/query_check.h"
#include "app/report/crosscheck/check_report.h"
#include "app/terminal/messages.h"
#include "common/backend.h"
#include "scenes/scene_frames.h"

namespace mray::app {

/// Whether brute force takes at most 2e9 ray-triangle tests a frame.
bool brute_is_affordable(std::uint64_t triangles, const ViewSpec& view, std::uint32_t rays);

/// Instruction sets that are compared if `asked` is --simd: all that this machine has, one, or
/// none.
std::vector<std::string> simd_to_check(const std::string& asked);

/// Two instances of a backend and the tree that one of them refits.
struct BackendPair {
    std::unique_ptr<Backend> refits;
    std::unique_ptr<Backend> given;
    Bvh tree;
    /// As in CheckRow.
    std::string device = {};
    std::string device_name = {};
};

/// The backends of a run, which the scenes share, because a device takes a second to start.
struct CheckedBackends {
    /// Without SIMD.
    BackendPair cpu;
    /// One for each device.
    std::vector<BackendPair> vulkan;
    std::unique_ptr<Backend> brute;
};

/// Throws what the backends throw.
CheckedBackends make_checked_backends(const BackendOptions& options,
                                      const std::vector<morphray::VulkanDeviceInfo>& devices,
                                      const Messages& messages);

/// The results of check() for a frame, besides the comparisons of its variants.
struct CheckedFrame {
    /// One for each device.
    std::vector<TreeRow> trees;
    /// One for each variant, if queries are compared.
    std::vector<QueryRow> queries;
    /// One for each kind of rays.
};

/// Runs two instances of each backend. One refits its own tree from frame to frame and traces it.
/// The other is given trees: those that the other backends refitted, which are read back from a
/// device, and one that is built for the frame. A device takes none from another device. Each
/// instruction set of the CPU traces the tree that the CPU refitted and the tree that is built for
/// the frame.
class CrossChecker {
public:
    /// Receives each comparison as it is made.
    using OnRow = std::function<void(const CheckRow&)>;
    /// Is told before an image is traced, or a tree is built. Only the images that are no reference
    /// are compared.
    using OnImage = std::function<void(const std::string& name, bool is_compared)>;

    /// Builds at `first_frame`. Checks only the CPU without a device,
    /// and only Vulkan if options choose it. The backends take this scene. Throws what clip,
    /// builder and backends throw.
    CrossChecker(const CrosscheckOptions& options, SceneFrames& scene, double first_frame,
                 CheckedBackends& backends);

    /// Compares one frame for every kind of `rays`.
    CheckedFrame check(double frame, const std::vector<std::uint32_t>& rays,
                       const OnImage& on_image, const OnRow& on_row);

    /// Comparisons that check() makes for a frame and a kind of rays.
    std::size_t variant_count(std::uint32_t rays) const;
    /// The descriptions of the devices; empty without one.
    std::string device() const;

private:
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
        /// The pair of the device that traces or refitted; null without one.
        const BackendPair* device = nullptr;
    };

    void trace_reference(std::span<const vec3> positions, const Bvh& rebuilt,
                         const std::vector<std::uint32_t>& rays);
    /// Asks the reference, if queries are compared.
    void ask_reference(std::span<const vec3> positions, double frame);
    void compare_variant(const Variant& variant, double frame, const OnRow& on_row);
    void check_vulkan(BackendPair& pair, std::span<const vec3> positions, const Bvh& rebuilt,
                      double frame, const OnRow& on_row);
    void check_cpu(std::span<const vec3> positions, const Bvh& rebuilt, double frame,
                   const OnRow& on_row);
    void check_simd(const std::string& simd, std::span<const vec3> positions, const Bvh& rebuilt,
                    double frame, const OnRow& on_row);
    void compare_queries(const Variant& variant, const std::string& name);
    bool uses_brute(std::uint32_t rays) const;
    bool queries_use_brute() const;
    /// Whether the CPU's images are compared; otherwise the CPU only refits and traces the
    /// reference.
    bool checks_cpu() const;
    void refit(BackendPair& pair, std::span<const vec3> positions);
    ImageParams params_for(std::uint32_t rays) const;

    const CrosscheckOptions& options_;
    SceneFrames& scene_;
    /// Instruction sets to check.
    std::vector<std::string> simd_;
    CheckedBackends& backends_;
    OnImage on_image_;
    std::vector<Expected> expected_;
    /// Without questions none are compared.
    Questions questions_;
    Answers expected_answers_;
    /// Belongs to the frame that is being checked.
    QueryRow query_row_;
    std::vector<QueryRow> query_rows_;
};

}  // namespace mray::app
