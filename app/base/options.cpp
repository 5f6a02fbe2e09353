#include "app/base/options.h"

namespace mray::app {

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
