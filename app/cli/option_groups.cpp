#include "app/cli/option_groups.h"

#include <fmt/format.h>

#include "common/base/errors.h"
#include "common/simd/simd_target.h"

namespace mray::app {
namespace {

/// A setter of what parse(option, value) returns.
template <class Target, class Parse>
auto parsed(Target& target, Parse parse) {
    return [&target, parse](const std::string& option, const std::string& value) {
        target = parse(option, value);
    };
}

auto at_least(double lower) {
    return [lower](const std::string& option, const std::string& value) {
        return parse_finite(option, value, lower);
    };
}

}  // namespace

CLI::Option* add_text(CLI::App& command, const char* names, const std::string& value_name,
                      const std::string& help, std::string& target) {
    return add_value(command, names, value_name, help,
                     [&target](const std::string&, const std::string& value) { target = value; });
}

CLI::Option* add_flag(CLI::App& command, const char* names, const std::string& help, bool& target) {
    return command.add_flag(names, target, help);
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
    add_flag(command, "--skip-missing",
             "interpolate missing frames of a sequence, which are an error otherwise",
             source.skip_missing);
    add_text(command, "--cache", "FILE",
             "point cache (PC2) with the positions of a mesh file's vertices", source.cache);
    add_text(command, "--animation", "NAME|INDEX", "animation of a glTF file (the first)",
             source.animation);
    constexpr double kLeastFps = 1e-3;
    add_value(command, "--fps", "N", "frames a second of a glTF file (24)",
              parsed(source.fps, at_least(kLeastFps)));
    add_lenient(command, source.lenient);
}

void add_lenient(CLI::App& command, bool& target) {
    add_flag(command, "--lenient",
             "accept vertices that are not finite, and leave out faces that are invalid", target);
}

void add_frames(CLI::App& command, std::string& target, const char* otherwise) {
    add_text(command, "--frames,--frame", "F|A..B[:STEP],...|all",
             fmt::format("frames, in increasing order; fractions lie between whole frames ({})",
                         otherwise),
             target);
}

CLI::Option* add_frame(CLI::App& command, std::optional<double>& target) {
    constexpr double kLeast = -1e9;
    return add_value(command, "--frame,--frames", "F",
                     "the frame; fractions lie between whole frames (the first)",
                     parsed(target, at_least(kLeast)));
}

void add_view_options(CLI::App& command, ViewSpec& view, const char* size, std::uint64_t least_ao,
                      const char* ao) {
    add_value(command, "--size", "WxH", fmt::format("size of the image in pixels ({})", size),
              [&view](const std::string& option, const std::string& value) {
                  const Size given = parse_size(option, value);
                  view.width = given.width;
                  view.height = given.height;
              });
    add_value(command, "--eye", "X,Y,Z", "position of the camera", parsed(view.eye, parse_point));
    add_value(command, "--target", "X,Y,Z", "point that the camera looks at",
              parsed(view.target, parse_point));
    add_value(command, "--up", "X,Y,Z", "upwards in the image (0,1,0)",
              parsed(view.up, parse_point));
    add_value(command, "--fov", "DEGREES", "vertical field of view (45)",
              parsed(view.fov, parse_number));
    add_value(command, "--light", "X,Y,Z", "point light", parsed(view.light, parse_point));
    add_count(command, "--ao-samples",
              fmt::format("ambient-occlusion rays a camera ray, {} to 256 ({})", least_ao, ao),
              view.ao_count, least_ao, 256);
    add_value(command, "--ao-distance", "LENGTH",
              "length of ambient-occlusion rays (a quarter of the scene's diagonal)",
              parsed(view.ao_distance, at_least(0)));
}

CLI::Option* add_rays(CLI::App& command, ViewSpec& view, const char* otherwise) {
    return add_choice<std::uint32_t>(
        command, "--rays", fmt::format("what each pixel traces ({})", otherwise), kRays, view.rays);
}

void add_backend_options(CLI::App& command, BackendOptions& backend,
                         std::span<const Choice<BackendChoice>> choices, const char* otherwise) {
    add_choice<BackendChoice>(command, "--backend", fmt::format("what traces ({})", otherwise),
                              choices, backend.choice);
    add_text(command, "--device", "DEVICE",
             "Vulkan device: its index, a part of its name, or its UUID (see `devices`)",
             backend.device);
    add_threads(command, backend.threads);
    add_value(command, "--simd", "NAME",
              "CPU instruction set (the best one; see `info`), or off: the scalar reference",
              [&backend](const std::string& option, const std::string& value) {
                  try {
                      check_simd(value);
                  } catch (const Error& error) {
                      throw Error(error.kind(), option + ": " + error.what());
                  }
                  backend.simd = value;
              });
    add_flag(command, "--validate", "run under the Vulkan validation layer", backend.validate);
}

void add_threads(CLI::App& command, int& target) {
    add_count(command, "--threads", "CPU threads, 1 to 1024 (as many as the machine has)", target,
              1, 1024);
}

void add_build_at(CLI::App& command, std::optional<double>& target) {
    constexpr double kLeast = -1e9;
    add_value(command, "--build-at", "FRAME",
              "frame whose positions the tree is built at (the first frame)",
              parsed(target, at_least(kLeast)));
}

CLI::Option* add_json(CLI::App& command, std::string& target) {
    return add_text(command, "--json", "FILE|-", "a report for programs; - is stdout", target);
}

}  // namespace mray::app
