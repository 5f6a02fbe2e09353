#include "app/cli/option_groups.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/base/messages.h"
#include "common/simd/simd_target.h"
#include "common/text/text.h"

namespace mray::app {
namespace {

// Numbers are read as in files, to the nearest double.

/// Any number, also one that is not finite; camera_setup decides whether it is usable.
double parse_number(std::string_view text) {
    const std::optional<double> value = parse_double(text);
    if (!value) refuse(quote(text) + " is not a number");
    return *value;
}

Point parse_point(const std::string& text) {
    const std::vector<std::string_view> parts = split(text, ',');
    if (parts.size() != 3) refuse(quote(text) + " is not a point x,y,z");
    return {parse_number(parts[0]), parse_number(parts[1]), parse_number(parts[2])};
}

}  // namespace

double parse_finite(const std::string& text, double lower) {
    const double value = parse_number(text);
    if (!std::isfinite(value) || value < lower)
        refuse(fmt::format("{} is not a finite number of at least {}", quote(text), lower));
    return value;
}

double parse_frame(const std::string& text) {
    constexpr double kLeast = -1e9;
    return parse_finite(text, kLeast);
}

CLI::Option* add_text(CLI::App& command, const char* names, const std::string& value_name,
                      const std::string& help, std::string& target) {
    return command.add_option(names, target, help)
        ->option_text(value_name)
        ->check([](const std::string& text) {
            return std::string(text.empty() ? "the value is empty" : "");
        });
}

CLI::Option* add_pair(CLI::App& command, const char* name, const char* value_name,
                      const std::string& help, char separator, std::int64_t lower,
                      std::uint32_t& first, std::uint32_t& second) {
    const auto set = [=, &first, &second](const std::string& text) {
        constexpr std::int64_t kMost = std::numeric_limits<std::uint32_t>::max();
        const std::size_t end = std::min(text.find(separator), text.size() - 1);
        const std::int64_t a = parse_integer(text.substr(0, end)).value_or(-1);
        const std::int64_t b = parse_integer(text.substr(end + 1)).value_or(-1);
        if (std::min(a, b) < lower || std::max(a, b) > kMost)
            throw CLI::ValidationError(name, fmt::format("{} is not {}, such as 640{}480",
                                                         quote(text), value_name, separator));
        first = static_cast<std::uint32_t>(a);
        second = static_cast<std::uint32_t>(b);
    };
    return command.add_option_function<std::string>(name, set, help)->option_text(value_name);
}

void refuse_file_name(const std::string& out, const char* advice) {
    for (const char* ending :
         {".png", ".jpg", ".jpeg", ".bmp", ".tga", ".tif", ".tiff", ".exr", ".svg", ".pdf", ".html",
          ".mp4", ".gif", ".webp", ".webm", ".mov", ".mkv", ".avi"})
        if (is_stdout(out) || lower_case(out).ends_with(ending))
            refuse(fmt::format("--out: {} is no name of a folder; {}", quote(out), advice));
}

CLI::Option* add_scene(CLI::App& command, SourceOptions& source) {
    CLI::Option* const scene =
        add_text(command, "SCENE", "",
                 "builtin:NAME[:TRIANGLES], a mesh file (.obj, .ply), a folder of such files, a "
                 "pattern such as frame_%04d.obj, or a .gltf or .glb file",
                 source.scene);
    scene->type_name("");
    add_source_options(command, source);
    return scene;
}

void add_source_options(CLI::App& command, SourceOptions& source) {
    heading(command, "Scene");
    command.add_flag("--skip-missing", source.skip_missing,
                     "interpolate missing frames of a sequence, which are an error otherwise");
    add_text(command, "--cache", "FILE",
             "point cache (PC2) with the positions of a mesh file's vertices", source.cache);
    add_text(command, "--animation", "NAME|INDEX", "animation of a glTF file (the first)",
             source.animation);
    constexpr double kLeastFps = 1e-3;
    add_parsed(command, "--fps", "N", "frames a second of a glTF file (24)", source.fps,
               [](const std::string& text) { return parse_finite(text, kLeastFps); });
    add_lenient(command, source.lenient);
}

void add_lenient(CLI::App& command, bool& target) {
    command.add_flag("--lenient", target,
                     "accept vertices that are not finite, and leave out faces that are invalid");
}

void add_frames(CLI::App& command, std::string& target, const char* otherwise) {
    add_text(command, "--frames,--frame", "F|A..B[:STEP],...|all",
             fmt::format("frames, in increasing order; fractions lie between whole frames ({})",
                         otherwise),
             target);
}

CLI::Option* add_frame(CLI::App& command, std::optional<double>& target) {
    return add_parsed(command, "--frame,--frames", "F",
                      "the frame; fractions lie between whole frames (the first)", target,
                      parse_frame);
}

void add_view_options(CLI::App& command, morphray::View& view, const char* size,
                      std::uint32_t least_ao, const char* ao) {
    heading(command, "Image");
    add_pair(command, "--size", "WxH", fmt::format("size of the image in pixels ({})", size), 'x',
             1, view.width, view.height);
    add_parsed(command, "--eye", "X,Y,Z", "position of the camera", view.eye, parse_point);
    add_parsed(command, "--target", "X,Y,Z", "point that the camera looks at", view.target,
               parse_point);
    add_parsed(command, "--up", "X,Y,Z", "upwards in the image (0,1,0)", view.up, parse_point);
    add_parsed(command, "--fov", "DEGREES", "vertical field of view (45)", view.fov, parse_number);
    add_parsed(command, "--light", "X,Y,Z", "point light", view.light, parse_point);
    add_count(command, "--ao-samples",
              fmt::format("ambient-occlusion rays a camera ray, {} to 256 ({})", least_ao, ao),
              view.ao_count, least_ao, 256);
    add_parsed(command, "--ao-distance", "LENGTH",
               "length of ambient-occlusion rays (a quarter of the scene's diagonal)",
               view.ao_distance, [](const std::string& text) { return parse_finite(text, 0); });
}

CLI::Option* add_rays(CLI::App& command, morphray::View& view, const char* otherwise) {
    return add_choice<morphray::Rays>(
        command, "--rays", fmt::format("what each pixel traces ({})", otherwise), kRays, view.rays);
}

void add_backend_options(CLI::App& command, BackendOptions& backend,
                         std::span<const Choice<BackendChoice>> choices, const char* otherwise) {
    heading(command, "Backend");
    add_choice<BackendChoice>(command, "--backend", fmt::format("what traces ({})", otherwise),
                              choices, backend.choice);
    add_text(command, "--device", "DEVICE",
             "Vulkan device: its index, a part of its name, or its UUID (see `devices`)",
             backend.device);
    add_count(command, "--threads", "CPU threads, 1 to 1024 (as many as the machine has)",
              backend.threads, 1, 1024);
    add_parsed(command, "--simd", "NAME",
               "CPU instruction set (the best one; see `info`), or off: the scalar reference",
               backend.simd, [](const std::string& text) {
                   check_simd(text);
                   return text;
               });
    command.add_flag("--validate", backend.validate, "run under the Vulkan validation layer");
}

void add_build_at(CLI::App& command, std::optional<double>& target) {
    heading(command, "Tree");
    add_parsed(command, "--build-at", "FRAME",
               "frame whose positions the tree is built at (the first frame)", target, parse_frame);
}

CLI::Option* add_json(CLI::App& command, std::string& target) {
    return add_text(command, "--json", "FILE|-", "a report for programs; - is stdout", target);
}

}  // namespace mray::app
