#include "app/base/options.h"

namespace mray::app {

std::vector<std::string> arguments_of(const Options& options, morphray::Rays rays, bool is_lit) {
    const morphray::View& view = options.view;
    const morphray::View standard;
    std::vector<std::string> arguments;
    const auto add = [&arguments](const char* name, const std::string& value) {
        if (!value.empty()) arguments.insert(arguments.end(), {name, value});
    };
    const auto add_point = [&add](const char* name, const morphray::Point& point) {
        add(name, fmt::format("{}", fmt::join(point, ",")));
    };
    add("--size", fmt::format("{}x{}", view.width, view.height));
    if (view.eye) add_point("--eye", *view.eye);
    if (view.target) add_point("--target", *view.target);
    if (view.up != standard.up) add_point("--up", view.up);
    if (view.fov != standard.fov) add("--fov", fmt::format("{}", view.fov));
    if (view.light && (is_lit || rays == morphray::Rays::shadow)) add_point("--light", *view.light);
    if (is_lit || rays == morphray::Rays::ao) {
        add("--ao-samples", fmt::format("{}", view.ao_count));
        if (view.ao_distance > 0) add("--ao-distance", fmt::format("{}", view.ao_distance));
    }
    if (options.source.skip_missing) arguments.emplace_back("--skip-missing");
    add("--cache", options.source.cache);
    add("--animation", options.source.animation);
    if (options.source.fps) add("--fps", fmt::format("{}", *options.source.fps));
    if (options.source.lenient) arguments.emplace_back("--lenient");
    return arguments;
}

}  // namespace mray::app
