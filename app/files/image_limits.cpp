#include "app/files/image_limits.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/errors.h"
#include "common/text/message_text.h"

namespace mray::app {

void ImageLimits::require(const std::filesystem::path& path, std::uint64_t width,
                          std::uint64_t height) const {
    if (std::max(width, height) > side || width * height > pixels) {
        throw Error(ErrorKind::kLimit,
                    fmt::format("{}: has {}x{} pixels; at most {} a side and {} in all can be "
                                "read, make it smaller",
                                shown(path), width, height, side, pixels));
    }
}

}  // namespace mray::app
