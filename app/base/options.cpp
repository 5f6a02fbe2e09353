#include "app/base/options.h"

namespace mray::app {

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
    if (view.eye) add("--eye", fmt::format("{}", fmt::join(*view.eye, ",")));
    if (view.target) add("--target", fmt::format("{}", fmt::join(*view.target, ",")));
    if (view.up != standard.up) add("--up", fmt::format("{}", fmt::join(view.up, ",")));
    if (view.fov != standard.fov) add("--fov", fmt::format("{}", view.fov));
    if (view.light && (is_lit || rays == morphray::Rays::shadow))
        add("--light", fmt::format("{}", fmt::join(*view.light, ",")));
    if (is_lit || rays == morphray::Rays::ao) {
        add("--ao-samples", fmt::format("{}", view.ao_count));
        if (view.ao_distance > 0) add("--ao-distance", fmt::format("{}", view.ao_distance));
    }
    return arguments;
}

}  // namespace mray::app
