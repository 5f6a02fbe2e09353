#include "app/cli/options.h"

namespace mray::app {

const char* name_of_rays(std::uint32_t rays) {
    if (rays == kRaysShadow) return "shadow";
    return rays == kRaysAo ? "ao" : "primary";
}

const char* name_of(SplitMethod split) {
    return split == SplitMethod::kBinned ? "binned" : "sweep";
}

}  // namespace mray::app
