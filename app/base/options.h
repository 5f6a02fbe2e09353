// The command line as plain data.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/numbers.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/scene/camera_setup.h"
#include "common/update/policy/update_policy.h"
#include "morphray/image.hpp"
#include "morphray/queries.hpp"
#include "scenes/source/open_scene.h"

namespace mray::app {

enum class Command {
    kRender,
    kCrosscheck,
    kDiff,
    kProbe,
    kProfile,
    kTrace,
    kQuery,
    kChart,
    kInfo,
    kDevices,
    kView
};

enum class BackendChoice { kAuto, kCpu, kVulkan, kBrute };

/// Which backend refits: kOwn is the one that traces.
enum class RefitOn { kOwn, kCpu, kVulkan };

/// How progress is shown: kAuto is a bar on a terminal, elsewhere nothing.
enum class ProgressChoice { kAuto, kPlain, kJson, kOff };

/// The tracer whose images crosscheck expects.
enum class Reference { kAuto, kBrute, kCpu };

struct BackendOptions {
    BackendChoice choice = BackendChoice::kAuto;
    /// Whether --backend was given; otherwise trace and query take the CPU.
    bool choice_given = false;
    std::string device;
    /// Whether crosscheck compares every usable device.
    bool all_devices = false;
    /// 0: as many as the machine has.
    int threads = 0;
    /// As cpu::CpuConfig::simd.
    std::string simd;
    bool validate = false;
};

/// The form of the answers of trace and query.
enum class AnswerForm { kText, kJson };

/// Questions about a point.
enum class Question { kInside, kWinding, kDistance, kClosest };

/// How render shades.
struct ShadingOptions {
    /// Not given: lit, or plain with --rays.
    std::optional<morphray::Shading> shading;
    /// Not given: 4 with lit, else 1.
    std::optional<std::uint32_t> samples;
    bool flat = false;
    /// "half" or "float": write EXR files, too; empty: none.
    std::string exr;
    /// Whether the scene stands on a plane that shows the background.
    bool ground = false;
};

struct TreeOptions {
    /// None: none is given, and the command has no default.
    std::optional<PolicySpec> update;
    UpdateConfig update_config;
    RefitOn refit_on = RefitOn::kOwn;
    SplitMethod split = SplitMethod::kBinned;
    /// The frame at whose positions the tree is built; none: the first selected frame.
    std::optional<double> build_at;

    /// The policy, which is given or the default of the command.
    PolicySpec policy() const { return update.value_or(PolicySpec{}); }
    bool has_policy(PolicyKind kind) const { return update && update->kind == kind; }
};

struct Options {
    Command command = Command::kInfo;
    std::string scene;

    std::string frames;
    /// Seconds, in place of frames.
    std::string time;
    /// ClipOptions::fps and animation.
    std::optional<double> fps;
    std::string animation;
    MissingFrames missing = MissingFrames::kFail;
    /// ClipOptions::cache.
    std::string cache;
    bool allow_empty = false;
    bool lenient = false;

    ViewSpec view;
    bool size_given = false;
    /// Whether --rays was given; otherwise crosscheck takes all three kinds.
    bool rays_given = false;
    bool ao_samples_given = false;
    ShadingOptions shading;

    BackendOptions backend;
    TreeOptions tree;
    /// render: images of an earlier run that are right are kept.
    bool skip_existing = false;

    std::string out;
    std::string json;
    std::string csv;
    std::string junit;
    std::string hits;
    ProgressChoice progress = ProgressChoice::kAuto;
    bool quiet = false;
    bool verbose = false;

    // crosscheck
    Reference reference = Reference::kAuto;
    std::string html;
    /// The number of rays and of points a frame that the backends are asked about.
    std::uint32_t query_count = 0;

    // diff: the file that is expected, and the other one
    std::vector<std::string> compared_files;

    // probe
    double frame = 0;
    bool frame_given = false;
    Pixel pixel;
    bool pixel_given = false;

    // view; `frame` is the first one that is shown
    std::string screenshot;
    bool plays = false;

    // profile
    int repeat = 10;
    /// Update policies to compare; none: profile reports times of the stages.
    std::vector<PolicySpec> policies;
    std::string plot;
    /// A report of an earlier run, and by how much a stage may be slower than there.
    std::string baseline;
    double tolerance_percent = 5;
    bool tolerance_given = false;

    // trace
    std::string ray_file;
    bool binary_rays = false;
    bool all_hits = false;
    morphray::AllHitsOptions hit_lists;

    // trace and query
    AnswerForm format = AnswerForm::kText;

    // query
    std::string point_file;
    /// Each at most once, in the order of the answers.
    std::vector<Question> questions;
    morphray::FillRule rule = morphray::FillRule::nonzero;
    float max_distance = std::numeric_limits<float>::infinity();

    // chart and crosscheck
    std::vector<std::string> scenes;

    // chart
    bool quick = false;

    // info
    bool tree_facts = false;
    bool formats = false;

    /// Whether `devices` tests them.
    bool checks_devices = false;

    /// The given arguments that decide which image is traced, pairs of a name and a value.
    std::vector<std::string> view_arguments;
    /// The command line without the program's name.
    std::vector<std::string> arguments;
    /// The options in it, each by its first long name in the help, such as "--out" for -o.
    std::vector<std::string> given;

    bool is_given(std::string_view option) const {
        return std::find(given.begin(), given.end(), option) != given.end();
    }
};

/// Whether the frames of the scene are at times: --fps says how many a second has.
bool has_seconds(const Options& options);
/// The view_arguments for a command about options.scene that names frames, not seconds: --fps only
/// where the scene has seconds.
std::vector<std::string> scene_view_arguments(const Options& options);
/// Whether --out of render names one image instead of a folder.
bool renders_one_image(const Options& options);
/// "primary", "shadow" or "ao" of kRaysPrimary, kRaysShadow, kRaysAo.
const char* name_of_rays(std::uint32_t rays);
/// Whether colours show the tree: steps and sah.
bool shows_tree(morphray::Shading shading);
/// "lit", "plain", ...
const char* name_of(morphray::Shading shading);
/// "binned" or "sweep".
const char* name_of(SplitMethod split);

}  // namespace mray::app
