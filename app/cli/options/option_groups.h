// Groups of options that several commands have in common.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "app/cli/options/option_adder.h"

namespace mray::app {

/// The scene and how strictly it is read.
void add_scene(const OptionAdder& adder, bool required, const char* help = "what to trace");
/// One scene or several.
void add_scenes(const OptionAdder& adder, const char* help);
/// How strictly a scene is read.
void add_file_options(const OptionAdder& adder);
void add_lenient(const OptionAdder& adder);

/// --frames and --time; `otherwise` says which frames are the default.
void add_frames(const OptionAdder& adder, const char* otherwise);
/// The help of --frame where the first one is the default.
inline constexpr const char* kFirstFrame =
    "the frame; fractions lie between whole frames (the first)";
/// --frame and --time, of a command that takes one.
void add_frame(const OptionAdder& adder, const char* help);

/// The smallest number of ambient-occlusion rays, and the help for it.
struct AoCount {
    std::uint64_t least = 1;
    const char* help = "ambient-occlusion rays a pixel, 1 to 256 (16)";
};

/// Image, camera, light and kind of rays, with the defaults to show.
void add_view_options(const OptionAdder& adder, const char* default_size, const char* default_rays,
                      const AoCount& ao_count = {});

/// Whether there is --exr, and the help of --samples.
struct ShadingHelp {
    bool has_exr = true;
    const char* samples = "camera rays a pixel (4 with lit and without --hits, else 1)";
};

/// How render and view shade, and the ground.
void add_shading_options(const OptionAdder& adder, const ShadingHelp& help = {});

/// --backend with these choices and the default to show, device, threads, and --simd with the
/// default to show.
void add_backend_options(const OptionAdder& adder, std::span<const Choice<BackendChoice>> choices,
                         const char* otherwise, const char* simd = "the best one");
void add_threads(const OptionAdder& adder);

/// How the tree is built and updated. `update` is the default of --update; none leaves out the
/// options of updates.
void add_tree_options(const OptionAdder& adder, std::optional<PolicySpec> update);
void add_update_limits(const OptionAdder& adder);

/// --format, of the answers of trace and query.
void add_answer_form(const OptionAdder& adder);

/// --skip-existing of render.
void add_skip_existing(const OptionAdder& adder);

/// --progress, of commands that take long.
void add_progress(const OptionAdder& adder);

/// --json, and with `with_quiet` also --progress, --quiet and --verbose.
void add_report_options(const OptionAdder& adder, bool with_quiet);

}  // namespace mray::app
