#include "app/cli/options/option_groups.h"

#include <fmt/format.h>

#include "app/base/numbers.h"
#include "app/base/update_options.h"
#include "common/base/errors.h"
#include "common/simd/simd_target.h"

namespace mray::app {
namespace {

/// A setter that writes the value, parsed by `parse(option, value)`, to `target`.
template <class Target, class Parse>
Setter parsed(Target& target, Parse parse) {
    return [&target, parse](const std::string& option, const std::string& value) {
        target = static_cast<Target>(parse(option, value));
    };
}

/// A setter of a whole number in [lower, upper].
template <class Count>
Setter counted(Count& target, std::uint64_t lower, std::uint64_t upper) {
    return parsed(target, [lower, upper](const std::string& option, const std::string& value) {
        return parse_count(option, value, lower, upper);
    });
}

/// A setter of a finite number of at least `lower`.
template <class Number>
Setter finite(Number& target, double lower) {
    return parsed(target, [lower](const std::string& option, const std::string& value) {
        return parse_finite(option, value, lower);
    });
}

double parse_one_frame(const std::string& option, const std::string& value) {
    if (value == "all" || value.find("..") != std::string::npos ||
        value.find(',') != std::string::npos) {
        throw Error(
            ErrorKind::kBadArgument,
            fmt::format("{}: '{}' are several frames; this command takes one", option, value));
    }
    constexpr double kLeast = -1e9;
    return parse_finite(option, value, kLeast);
}

void add_camera(const OptionAdder& adder) {
    ViewSpec& view = adder.options().view;
    adder.add_view("--eye", "X,Y,Z", "position of the camera", parsed(view.eye, parse_point));
    adder.add_view("--target", "X,Y,Z", "point that the camera looks at",
                   parsed(view.target, parse_point));
    adder.add_view("--up", "X,Y,Z", "upwards in the image (0,1,0)", parsed(view.up, parse_point));
    adder.add_view("--fov", "DEGREES", "vertical field of view (45)",
                   parsed(view.fov, parse_number));
    adder.add_view("--light", "X,Y,Z", "point light", parsed(view.light, parse_point));
}

}  // namespace

void add_scene(const OptionAdder& adder, bool required, const char* help) {
    Options& options = adder.options();
    adder.add_text("scene", "SCENE", help, options.scene).required = required;
    add_file_options(adder);
}

void add_scenes(const OptionAdder& adder, const char* help) {
    adder.add_arguments("scenes", "SCENE", help, {&adder.options().scenes});
}

void add_file_options(const OptionAdder& adder) {
    Options& options = adder.options();
    adder.add_view(
        "--missing", "fail|hold|skip",
        "what to do about missing frames of a sequence: an error, the frame before again, "
        "or positions between those of its neighbours",
        parsed(options.missing, [](const std::string& option, const std::string& value) {
            return parse_choice<MissingFrames>(option, value, kMissing);
        }));
    adder.add_view(
        "--cache", "FILE", "point cache (PC2 or MDD) with the positions of a mesh file's vertices",
        [&options](const std::string&, const std::string& value) { options.cache = value; });
    adder.add_view(
        "--animation", "NAME|INDEX", "animation of a glTF file (the first)",
        [&options](const std::string&, const std::string& value) { options.animation = value; });
    constexpr double kLeastFps = 1e-3;
    adder.add_view("--fps", "N", "frames a second of a scene that has seconds (24)",
                   finite(options.fps, kLeastFps));
    adder.add_flag("--allow-empty", "accept a scene without triangles", options.allow_empty);
    add_lenient(adder);
}

void add_lenient(const OptionAdder& adder) {
    adder.add_flag("--lenient",
                   "accept vertices that are not finite, and leave out faces that are invalid",
                   adder.options().lenient);
}

void add_frames(const OptionAdder& adder, const char* otherwise) {
    adder.add_text(
        "--frames,--frame", "F|A..B[:STEP],...|all",
        fmt::format("frames, in increasing order; fractions lie between whole frames ({})",
                    otherwise),
        adder.options().frames);
    adder.add_text("--time", "T|A..B[:STEP],...",
                   "seconds instead of frames; STEP is that of a frame unless given",
                   adder.options().time);
}

void add_frame(const OptionAdder& adder, const char* help) {
    Options& options = adder.options();
    adder.add("--frame,--frames", "F", help,
              [&options](const std::string& option, const std::string& value) {
                  options.frame = parse_one_frame(option, value);
                  options.frame_given = true;
                  options.frames = value;
              });
    adder.add("--time", "T", "seconds instead of a frame",
              [&options](const std::string& option, const std::string& value) {
                  parse_finite(option, value, 0);
                  options.time = value;
              });
}

void add_view_options(const OptionAdder& adder, const char* default_size, const char* default_rays,
                      const AoCount& ao_count) {
    Options& options = adder.options();
    adder.add("--size", "WxH", fmt::format("size of the image in pixels ({})", default_size),
              [&options](const std::string& option, const std::string& value) {
                  const Size size = parse_size(option, value);
                  options.view.width = size.width;
                  options.view.height = size.height;
                  options.size_given = true;
              });
    add_camera(adder);
    adder.add("--rays", "primary|shadow|ao",
              fmt::format("what each pixel traces ({})", default_rays),
              [&options](const std::string& option, const std::string& value) {
                  options.view.rays = parse_choice<std::uint32_t>(option, value, kRays);
                  options.rays_given = true;
              });
    adder.add_view(
        "--ao-samples", "N", ao_count.help,
        [&options, least = ao_count.least](const std::string& option, const std::string& value) {
            options.view.ao_count =
                static_cast<std::uint32_t>(parse_count(option, value, least, 256));
            options.ao_samples_given = true;
        });
    adder.add_view("--ao-distance", "LENGTH",
                   "length of ambient-occlusion rays; 0: a quarter of the scene's diagonal",
                   [&options](const std::string& option, const std::string& value) {
                       options.view.ao_distance = parse_finite(option, value, 0);
                   });
}

void add_shading_options(const OptionAdder& adder, const ShadingHelp& help) {
    ShadingOptions& shading = adder.options().shading;
    adder.add("--shading", names_of<morphray::Shading>(kShadings),
              "what colours show (lit; plain with --rays)",
              [&shading](const std::string& option, const std::string& value) {
                  shading.shading = parse_choice<morphray::Shading>(option, value, kShadings);
              });
    adder.add("--samples", "1|4|16|64", help.samples,
              [&shading](const std::string& option, const std::string& value) {
                  shading.samples = parse_choice<std::uint32_t>(option, value, kSampleCounts);
              });
    if (help.has_exr) {
        adder.add("--exr", names_of<const char*>(kExrColours),
                  "also OpenEXR files, with linear colours and layers",
                  [&shading](const std::string& option, const std::string& value) {
                      shading.exr = parse_choice<const char*>(option, value, kExrColours);
                  });
    }
    adder.add_flag("--flat", "without smooth normals", shading.flat);
    adder.add_flag("--ground", "with a plane below the scene that shows the background",
                   shading.ground);
}

void add_backend_options(const OptionAdder& adder, std::span<const Choice<BackendChoice>> choices,
                         const char* otherwise, const char* simd) {
    BackendOptions& backend = adder.options().backend;
    adder.add("--backend", names_of<BackendChoice>(choices),
              fmt::format("what traces ({})", otherwise),
              [&backend, choices](const std::string& option, const std::string& value) {
                  backend.choice = parse_choice<BackendChoice>(option, value, choices);
                  backend.choice_given = true;
              });
    adder.add_text("--device", "DEVICE",
                   "Vulkan device: its index, a part of its name, or its UUID (see `devices`)",
                   backend.device);
    add_threads(adder);
    adder.add(
        "--simd", "NAME",
        fmt::format("CPU instruction set ({}; see `info`), or off: the scalar reference", simd),
        [&backend](const std::string& option, const std::string& value) {
            try {
                check_simd(value);
            } catch (const Error& error) {
                throw Error(error.kind(), option + ": " + error.what());
            }
            backend.simd = value;
        });
    adder.add_flag("--validate", "run under the Vulkan validation layer", backend.validate);
}

void add_threads(const OptionAdder& adder) {
    adder.add("--threads", "N", "CPU threads, 1 to 1024 (as many as the machine has)",
              counted(adder.options().backend.threads, 1, 1024));
}

void add_tree_options(const OptionAdder& adder, std::optional<PolicySpec> update) {
    TreeOptions& tree = adder.options().tree;
    if (update) {
        adder.command().set_defaults = [&tree, update] { tree.update = update; };
        adder.add("--update", update_forms(),
                  fmt::format("how the tree follows the vertices ({})", text_of(*update)),
                  parsed(tree.update, parse_update));
        add_update_limits(adder);
        adder.add_choice("--refit-on", "which backend refits (the one that traces)", kRefitOn,
                         tree.refit_on);
    }
    adder.add_view("--build", "binned|sweep", "how the tree is built (binned)",
                   parsed(tree.split, [](const std::string& option, const std::string& value) {
                       return parse_choice<SplitMethod>(option, value, kSplits);
                   }));
    adder.add("--build-at", "FRAME", "frame whose positions the tree is built at (the first frame)",
              finite(tree.build_at, -1e9));
}

void add_update_limits(const OptionAdder& adder) {
    UpdateConfig& config = adder.options().tree.update_config;
    adder.add(
        "--update-budget", "N%|Nms",
        "what an update may add to a frame; longer work is done in slices or in the background "
        "(75%)",
        [&config](const std::string& option, const std::string& value) {
            parse_update_budget(option, value, config);
        });
    adder.add_flag("--deterministic-updates",
                   "decide from counts of triangles and rays instead of times",
                   config.deterministic);
}

void add_skip_existing(const OptionAdder& adder) {
    adder.add_flag("--skip-existing",
                   "keep images that are whole, of this scene, these options and this version",
                   adder.options().skip_existing);
}

void add_answer_form(const OptionAdder& adder) {
    adder.add_choice("--format", "the form of the answers; npy: records of numpy (text)",
                     kAnswerForms, adder.options().format);
}

void add_progress(const OptionAdder& adder) {
    adder.add_choice("--progress",
                     "progress on stderr: plain lines, an object a line as JSON, or none (auto: a "
                     "line that moves on a terminal)",
                     kProgress, adder.options().progress);
}

void add_report_options(const OptionAdder& adder, bool with_quiet) {
    Options& options = adder.options();
    adder.add_text("--json", "FILE|-", "a report for programs; - is stdout", options.json);
    if (!with_quiet) return;
    add_progress(adder);
    adder.add_flag("-q,--quiet", "neither table nor progress", options.quiet);
    adder.add_flag("-v,--verbose", "say what is used and decided", options.verbose);
}

}  // namespace mray::app
