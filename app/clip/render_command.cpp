#include "app/clip/render_command.h"

#include <fmt/format.h>

#include "common/image/frame.h"
#include "common/report/shell_text.h"
#include "common/text/number_text.h"
#include "common/version.h"

namespace mray::app {

std::string render_command(const Options& options, double frame) {
    return render_command(options, {"--frames", fmt::format("{}", frame)});
}

std::string render_command(const Options& options, const std::vector<std::string>& frames) {
    const ViewSpec& view = options.view;
    const ShadingOptions& shading = options.shading;
    std::vector<std::string> line = {"morphray", "render", options.scene};
    const auto add = [&line](const char* name, const std::string& value) {
        line.insert(line.end(), {name, value});
    };
    line.insert(line.end(), frames.begin(), frames.end());
    add("--size", fmt::format("{}x{}", view.width, view.height));
    const std::vector<std::string> viewed = scene_view_arguments(options);
    line.insert(line.end(), viewed.begin(), viewed.end());
    if (options.rays_given) add("--rays", name_of_rays(view.rays));
    if (!options.rays_given) add("--shading", name_of(*shading.shading));
    if (shows_tree(*shading.shading)) {
        const TreeOptions& tree = options.tree;
        // A tree that is built at each frame is the same wherever the first one was built.
        if (tree.build_at && !tree.has_policy(PolicyKind::kRebuild))
            add("--build-at", fmt::format("{}", *tree.build_at));
        add("--update", text_of(tree.policy()));
    }
    add("--samples", fmt::format("{}", *shading.samples));
    if (shading.flat) line.push_back("--flat");
    if (shading.ground) line.push_back("--ground");
    if (options.allow_empty) line.push_back("--allow-empty");
    if (options.lenient) line.push_back("--lenient");
    return shell_line(line);
}

std::vector<PngText> pixel_texts(const Options& options, double frame,
                                 std::span<const std::uint32_t> pixels) {
    return {{"Software", software_text()},
            {"Source", render_command(options, frame)},
            {"Image hash", hash_text(image_hash(pixels))}};
}

std::string software_text() { return fmt::format("morphray {}", kVersionDetail); }

std::vector<PngText> image_texts(const Options& options, double frame, std::uint64_t scene_hash,
                                 const morphray::Image& image) {
    return {{"Software", software_text()},
            {"Source", render_command(options, frame)},
            {"Scene hash", hash_text(scene_hash)},
            {"Hits hash", hash_text(image.hits_hash)},
            {"Image hash", hash_text(image.image_hash)}};
}

Options with_render_defaults(Options options) {
    using morphray::Shading;
    ShadingOptions& shading = options.shading;
    if (!shading.shading) shading.shading = options.rays_given ? Shading::plain : Shading::lit;
    const bool is_lit = *shading.shading == Shading::lit;
    if (!shading.samples) shading.samples = is_lit && options.hits.empty() ? 4 : 1;
    constexpr std::uint32_t kLitAoCount = 8;
    if (is_lit && !options.ao_samples_given) options.view.ao_count = kLitAoCount;
    return options;
}

}  // namespace mray::app
