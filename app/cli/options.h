// What the command line asks for, as plain data.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/numbers.h"
#include "common/bvh/bvh_builder.h"
#include "common/scene/camera_setup.h"
#include "common/scene/scene_source.h"
#include "common/update/policy/update_policy.h"

namespace morphray::app {

enum class Command { kRender, kCrosscheck, kProbe, kProfile, kTrace, kChart, kInfo, kDevices };

enum class BackendChoice { kAuto, kCpu, kVulkan, kBrute };

/// Which backend refits: kOwn is the one that traces.
enum class RefitOn { kOwn, kCpu, kVulkan };

/// What crosscheck holds the variants against.
enum class Reference { kAuto, kBrute, kCpu };

struct BackendOptions {
    BackendChoice choice = BackendChoice::kAuto;
    /// Whether --backend was given: trace takes the CPU otherwise.
    bool choice_given = false;
    std::string device;
    /// 0: all that there are.
    int threads = 0;
    /// As cpu::CpuConfig::simd.
    std::string simd;
    bool validate = false;
};

struct TreeOptions {
    /// How the tree follows the vertices: the text of an update policy. Empty: what the command
    /// takes by itself.
    std::string update;
    UpdateConfig update_config;
    RefitOn refit_on = RefitOn::kOwn;
    SplitMethod split = SplitMethod::kBinned;
    /// The frame at whose positions the tree is built; none: the first frame asked for.
    std::optional<double> build_at;
};

struct Options {
    Command command = Command::kInfo;
    std::string scene;

    std::string frames;
    MissingFrames missing = MissingFrames::kFail;
    bool allow_empty = false;
    bool lenient = false;

    ViewSpec view;
    bool size_given = false;
    /// Whether --rays was given: crosscheck takes all three kinds otherwise.
    bool rays_given = false;

    BackendOptions backend;
    TreeOptions tree;

    std::string out;
    std::string json;
    std::string csv;
    std::string junit;
    std::string hits;
    bool quiet = false;
    bool verbose = false;

    // crosscheck
    Reference reference = Reference::kAuto;

    // probe
    double frame = 0;
    Pixel pixel;

    // profile
    int repeat = 5;
    /// Update policies to compare; none: times of the stages instead.
    std::vector<std::string> policies;
    std::string trace_events;
    std::string plot;

    // trace
    std::string ray_file;
    bool binary_rays = false;

    // chart
    std::vector<std::string> scenes;
    bool quick = false;

    // info
    bool tree_facts = false;

    /// The arguments that decide what is seen, as given, for a command that repeats it.
    std::vector<std::string> view_arguments;
};

/// "primary", "shadow" or "ao" of kRaysPrimary, kRaysShadow, kRaysAo.
const char* name_of_rays(std::uint32_t rays);
/// "binned" or "sweep".
const char* name_of(SplitMethod split);

}  // namespace morphray::app
