// The results of the commands, from which tables and JSON are made.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/clip_scene.h"
#include "app/commands/diff/exr_comparison.h"
#include "common/bvh/bvh_stats.h"
#include "common/image/compare.h"
#include "common/scene/clip.h"
#include "common/update/policy_runs.h"
#include "gpu/vulkan_backend.h"

namespace mray::app {

/// The head of every report.
struct ReportHead {
    std::string command;
    std::string scene;
    std::uint64_t triangles = 0;
    std::uint64_t vertices = 0;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
};

struct FrameReport {
    double frame = 0;
    std::string backend;
    /// name_of(TreeStep) and the reason for it.
    std::string update;
    std::string reason;
    double cost_ratio = 1;
    /// The backend that refitted, or empty.
    std::string refit_on;
    std::uint64_t hits_hash = 0;
    std::uint64_t image_hash = 0;
    std::uint64_t bvh_hash = 0;
    FrameTimes times;
    /// The time that render waited for the frame's positions, which are made while the frame before
    /// is traced; the time that its outputs took to encode and write, while later frames are
    /// traced; and the time that render waited for the outputs of earlier frames.
    double read_wait_ms = 0;
    double write_ms = 0;
    double write_wait_ms = 0;
    std::uint64_t hits = 0;
    std::uint64_t misses = 0;
    std::uint64_t occluded = 0;
    double sah_cost = 0;
    /// The image's file name, if there is one.
    std::string file;
};

/// Hashes, counts and times of an image that the scene has just rendered; with `with_tree` also of
/// the tree, which is read back from a device.
FrameReport report_frame(const ClipScene& scene, double frame_number, const morphray::Image& image,
                         bool with_tree);

struct RenderReport {
    ReportHead head;
    std::string backend;
    std::string device;
    std::string rays;
    std::string shading;
    /// Camera rays a pixel.
    std::uint32_t samples = 1;
    /// False if an error or a signal ended it early.
    bool complete = true;
    std::vector<FrameReport> frames;
    /// Frames whose images of an earlier run were kept.
    std::vector<double> kept;
};

/// Two files of hits.
struct DiffReport {
    std::string expected;
    std::string actual;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    /// One for each image of both files.
    std::vector<FrameDifference> images;

    std::uint64_t differing_images() const;
    std::uint64_t differing_pixels() const;
    bool equal() const { return differing_images() == 0; }
};

/// Two images.
struct ImageDiffReport {
    std::string expected;
    std::string actual;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    /// All in `colour`.
    FrameDifference difference;
    /// The largest difference of a channel, actual less expected, and its first pixel.
    struct Channel {
        int by = 0;
        std::uint32_t x = 0;
        std::uint32_t y = 0;
    };
    /// Red, green, blue, alpha.
    std::array<Channel, 4> channels;

    bool equal() const { return difference.total() == 0; }
};
inline constexpr std::array<const char*, 4> kChannelNames = {"red", "green", "blue", "alpha"};
/// "#rrggbbaa".
std::string colour_text(std::uint32_t pixel);

/// Two OpenEXR files.
struct ExrDiffReport {
    std::string expected;
    std::string actual;
    ExrComparison comparison;
};
/// The value of a channel: floats in hexadecimal.
std::string value_text(ExrType type, std::uint32_t bits);

/// A bundled ray traced again.
struct ReplayReport {
    std::string scene;
    double frame = 0;
    /// By brute force when it was bundled.
    Hit expected = no_hit();
    struct Answer {
        std::string tracer;
        Hit hit = no_hit();
        bool equal = false;
    };
    std::vector<Answer> answers;
};

/// Medians of one frame on one backend.
struct ProfileRow {
    double frame = 0;
    std::string backend;
    FrameTimes times;
    /// Tracing the rebuilt tree instead of the refitted one.
    double trace_rebuilt_ms = 0;
    double sah_cost = 0;
    double rebuilt_sah_cost = 0;
    /// The least times, which the load of the machine disturbs least.
    double least_update_ms = 0;
    double least_rebuild_ms = 0;
    double least_trace_ms = 0;
    double least_trace_rebuilt_ms = 0;
    /// The least time of the yardstick between the stages.
    double yardstick_ms = 0;
};

/// A stage on one backend compared with that of an earlier run, by least times: at the frame whose
/// change is the median, of an even number of frames the larger one in the middle.
struct StageChange {
    std::string backend;
    /// "update", "rebuild", "trace" or "trace, rebuilt".
    std::string stage;
    /// The stage's time in the baseline, in units of its yardstick, times this run's yardstick.
    double expected_ms = 0;
    double measured_ms = 0;
    /// The frame that became slower by most, and by how much.
    double worst_frame = 0;
    double worst_percent = 0;
    /// Whether the times are too short to be compared.
    bool is_too_short = false;

    /// The change, which is positive if the stage became slower.
    double percent() const { return 100 * (measured_ms / std::max(expected_ms, 1e-9) - 1); }
};

/// A run compared with an earlier one.
struct BaselineReport {
    std::string file;
    /// The version of the program that wrote the file.
    std::string version;
    double tolerance_percent = 0;
    std::vector<StageChange> stages;

    bool is_slower(const StageChange& stage) const {
        return !stage.is_too_short && stage.percent() > tolerance_percent;
    }
    std::size_t slower_stages() const;
};

struct ProfileReport {
    ReportHead head;
    std::string rays;
    int repeat = 0;
    bool complete = true;
    /// The most memory that the process held, both backends and the trees that it compares
    /// included.
    std::uint64_t peak_memory_bytes = 0;
    std::vector<ProfileRow> rows;
    /// The version of the program.
    std::string version;
    /// The kind of yardstick.
    std::string yardstick;
    /// The given options that decide what is measured.
    std::string options;
    std::optional<BaselineReport> baseline;
};

/// The time of refitting a whole scene of one size, transfer included.
struct RefitScaling {
    std::string backend;
    std::uint64_t triangles = 0;
    double ms = 0;
};

/// A clip under several policies on each backend.
struct PolicyReport {
    ReportHead head;
    std::string rays;
    int repeat = 0;
    std::vector<PolicyComparison> backends;
    /// For built-in scenes, if charts are asked for.
    std::vector<RefitScaling> scaling;
};

struct SceneReport {
    ReportHead head;
    double first_frame = 0;
    double last_frame = 0;
    /// Frames a second, if the scene has seconds.
    std::optional<double> fps;
    WorldBounds bounds;
    int exponent = 0;
    DegenerateCount degenerate;
    std::uint64_t topology_hash = 0;
    /// File names, and the number of triangles that show one of them.
    std::vector<std::string> textures;
    IndexUse index;
    std::uint64_t textured_triangles = 0;
    struct Tree {
        std::string build;
        double build_ms = 0;
        BvhStats stats;
        std::uint64_t bvh_hash = 0;
    };
    std::vector<Tree> trees;
};

/// "none", "absent", "used", "stale" or "bounds given".
const char* name_of(IndexUse::State state);

struct ProgramReport {
    std::string build;
    struct Builtin {
        std::string name;
        std::string description;
        std::uint32_t default_triangles = 0;
    };
    std::vector<Builtin> builtins;
    std::vector<std::string> backends;
};

}  // namespace mray::app
