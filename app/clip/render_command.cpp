#include "app/clip/render_command.h"

#include <fmt/format.h>

#include "app/base/choices.h"
#include "common/image/frame.h"
#include "common/report/shell.h"
#include "common/text/number_text.h"
#include "common/version.h"

namespace mray::app {

std::string render_command(const ImageOptions& options, double frame) {
    const ShadingOptions& shading = options.shading;
    std::vector<std::string> line = {"morphray", "render", options.source.scene, "--frames",
                                     fmt::format("{}", frame)};
    const auto add = [&line](const char* name, const std::string& value) {
        line.insert(line.end(), {name, value});
    };
    const bool is_plain = shading.shading == morphray::Shading::plain;
    const bool is_lit = shading.shading == morphray::Shading::lit;
    const std::uint32_t rays = is_plain ? options.view.rays : kRaysPrimary;
    for (const auto& part :
         {arguments_of(options.view, rays, is_lit), arguments_of(options.source)})
        line.insert(line.end(), part.begin(), part.end());
    if (is_plain)
        add("--rays", name_of_rays(rays));
    else
        add("--shading", name_in<morphray::Shading>(kShadings, shading.shading));
    if (options.tree.split != SplitMethod::kBinned) add("--build", "sweep");
    if (shows_tree(shading.shading)) {
        const TreeOptions& tree = options.tree;
        // A tree that is built at each frame is the same wherever the first one was built.
        if (tree.build_at && tree.update.kind != PolicyKind::kRebuild)
            add("--build-at", fmt::format("{}", *tree.build_at));
        add("--update", text_of(tree.update));
    }
    add("--samples", fmt::format("{}", shading.samples));
    if (shading.flat) line.push_back("--flat");
    if (shading.ground) line.push_back("--ground");
    return shell_line(line);
}

std::string software_text() { return fmt::format("morphray {}", kVersionDetail); }

std::vector<PngText> image_texts(const ImageOptions& options, double frame,
                                 std::uint64_t scene_hash, const morphray::Image& image) {
    return {{"Software", software_text()},
            {"Source", render_command(options, frame)},
            {"Scene hash", hash_text(scene_hash)},
            {"Hits hash", hash_text(image.hits_hash)},
            {"Image hash", hash_text(image.image_hash)}};
}

}  // namespace mray::app
