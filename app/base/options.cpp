#include "app/base/options.h"

#include <filesystem>
#include <system_error>

#include "scenes/gltf/gltf_clip.h"

namespace mray::app {

bool has_seconds(const Options& options) {
    return has_gltf_name(options.scene) && options.cache.empty();
}

std::vector<std::string> scene_view_arguments(const Options& options) {
    std::vector<std::string> kept;
    const std::vector<std::string>& all = options.view_arguments;
    for (std::size_t i = 0; i + 1 < all.size(); i += 2)
        if (all[i] != "--fps" || has_seconds(options))
            kept.insert(kept.end(), {all[i], all[i + 1]});
    return kept;
}

bool renders_one_image(const Options& options) {
    // A name that cannot be looked up is no folder; writing it says what is wrong.
    std::error_code error;
    return options.out.ends_with(".png") && !std::filesystem::is_directory(options.out, error);
}

const char* name_of_rays(std::uint32_t rays) {
    if (rays == kRaysShadow) return "shadow";
    return rays == kRaysAo ? "ao" : "primary";
}

bool shows_tree(morphray::Shading shading) {
    return shading == morphray::Shading::steps || shading == morphray::Shading::sah;
}

const char* name_of(morphray::Shading shading) {
    switch (shading) {
        case morphray::Shading::lit:
            return "lit";
        case morphray::Shading::normal:
            return "normal";
        case morphray::Shading::depth:
            return "depth";
        case morphray::Shading::prim:
            return "prim";
        case morphray::Shading::steps:
            return "steps";
        case morphray::Shading::sah:
            return "sah";
        default:
            return "plain";
    }
}

const char* name_of(SplitMethod split) {
    return split == SplitMethod::kBinned ? "binned" : "sweep";
}

}  // namespace mray::app
