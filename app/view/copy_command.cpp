#include "app/view/copy_command.h"

#include <fmt/format.h>

#include <vector>

#include "app/clip/render_command.h"
#include "common/report/shell_text.h"

namespace mray::app {
namespace {

using morphray::Shading;

std::string text_of(const Point& p) { return fmt::format("{},{},{}", p[0], p[1], p[2]); }

/// The arguments of `given` that input cannot change: how the scene is read and the tree is built.
std::vector<std::string> scene_arguments(const Options& given) {
    std::vector<std::string> kept;
    const std::vector<std::string> all = scene_view_arguments(given);
    for (std::size_t i = 0; i + 1 < all.size(); i += 2) {
        if (all[i] == "--cache" || all[i] == "--missing" || all[i] == "--build" ||
            all[i] == "--animation" || all[i] == "--fps")
            kept.insert(kept.end(), {all[i], all[i + 1]});
    }
    return kept;
}

std::vector<std::string> camera_arguments(const ViewSpec& view) {
    return {"--eye", text_of(*view.eye), "--target", text_of(*view.target),
            "--up",  text_of(view.up),   "--fov",    fmt::format("{}", view.fov)};
}

}  // namespace

Options render_options(const Options& given, const ImageRequest& request, const TreeOrigin& tree) {
    Options options = given;
    options.view = request.view;
    options.shading.shading = request.shading;
    options.shading.samples = request.samples;
    const bool is_lit = request.shading == Shading::lit;
    options.shading.flat = request.flat && (is_lit || request.shading == Shading::normal);
    options.shading.ground = request.scene.ground && is_lit;
    options.rays_given = request.shading == Shading::plain && request.view.rays != kRaysPrimary;
    std::vector<std::string>& line = options.view_arguments;
    line = scene_arguments(given);
    const std::vector<std::string> camera = camera_arguments(request.view);
    line.insert(line.end(), camera.begin(), camera.end());
    if (is_lit || (options.rays_given && request.view.rays == kRaysShadow))
        line.insert(line.end(), {"--light", text_of(*request.view.light)});
    if (is_lit || (options.rays_given && request.view.rays == kRaysAo)) {
        line.insert(line.end(), {"--ao-samples", fmt::format("{}", request.view.ao_count),
                                 "--ao-distance", fmt::format("{}", request.view.ao_distance)});
    }
    options.tree.build_at = tree.built_at;
    options.tree.update = PolicySpec{PolicyKind::kRefit};
    return options;
}

std::string copy_command(const Options& given, const ImageRequest& request,
                         const TreeOrigin& tree) {
    return render_command(render_options(given, request, tree), request.frame);
}

std::string probe_command(const Options& given, const ImageRequest& request, Pixel pixel) {
    std::vector<std::string> line = {"morphray",
                                     "probe",
                                     given.scene,
                                     "--frame",
                                     fmt::format("{}", request.frame),
                                     "--pixel",
                                     fmt::format("{},{}", pixel.x, pixel.y),
                                     "--size",
                                     fmt::format("{}x{}", request.view.width, request.view.height)};
    for (const auto& part : {camera_arguments(request.view), scene_arguments(given)})
        line.insert(line.end(), part.begin(), part.end());
    if (given.allow_empty) line.emplace_back("--allow-empty");
    if (given.lenient) line.emplace_back("--lenient");
    return shell_line(line);
}

bool is_reproducible(const ImageRequest& request, const TreeOrigin& tree) {
    return tree.is_refitted || !shows_tree(request.shading);
}

}  // namespace mray::app
