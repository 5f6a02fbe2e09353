#include "app/base/options.h"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>

namespace mray::app {
namespace {

std::string text_of(const morphray::Point& p) { return fmt::format("{},{},{}", p[0], p[1], p[2]); }

}  // namespace

std::vector<std::string> arguments_of(const SourceOptions& source) {
    std::vector<std::string> arguments;
    const auto add = [&arguments](const char* name, const std::string& value) {
        if (!value.empty()) arguments.insert(arguments.end(), {name, value});
    };
    if (source.skip_missing) arguments.emplace_back("--skip-missing");
    add("--cache", source.cache);
    add("--animation", source.animation);
    if (source.fps) add("--fps", fmt::format("{}", *source.fps));
    if (source.lenient) arguments.emplace_back("--lenient");
    return arguments;
}

std::vector<std::string> arguments_of(const morphray::View& view, morphray::Rays rays,
                                      bool is_lit) {
    const morphray::View standard;
    std::vector<std::string> arguments;
    const auto add = [&arguments](const char* name, const std::string& value) {
        arguments.insert(arguments.end(), {name, value});
    };
    add("--size", fmt::format("{}x{}", view.width, view.height));
    if (view.eye) add("--eye", text_of(*view.eye));
    if (view.target) add("--target", text_of(*view.target));
    if (view.up != standard.up) add("--up", text_of(view.up));
    if (view.fov != standard.fov) add("--fov", fmt::format("{}", view.fov));
    if (view.light && (is_lit || rays == morphray::Rays::shadow))
        add("--light", text_of(*view.light));
    if (is_lit || rays == morphray::Rays::ao) {
        add("--ao-samples", fmt::format("{}", view.ao_count));
        if (view.ao_distance > 0) add("--ao-distance", fmt::format("{}", view.ao_distance));
    }
    return arguments;
}

bool renders_one_image(const RenderOptions& options) {
    // A name that cannot be looked up is no folder; writing it says what is wrong.
    std::error_code error;
    return lower_case(options.out).ends_with(".png") &&
           !std::filesystem::is_directory(options.out, error);
}

const char* name_of_rays(morphray::Rays rays) {
    if (rays == morphray::Rays::shadow) return "shadow";
    return rays == morphray::Rays::ao ? "ao" : "primary";
}

bool shows_tree(morphray::Shading shading) {
    return shading == morphray::Shading::steps || shading == morphray::Shading::sah;
}

}  // namespace mray::app
