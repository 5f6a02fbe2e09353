#include "app/files/image_limits.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/base/memory_budget.h"
#include "common/base/errors.h"
#include "common/text/message_text.h"

namespace mray::app {

void ImageLimits::require(const std::filesystem::path& path, std::uint64_t width,
                          std::uint64_t height, std::uint64_t decoder_bytes) const {
    if (std::max(width, height) > side || width * height > pixels) {
        throw Error(ErrorKind::kLimit,
                    fmt::format("{}: has {}x{} pixels; at most {} a side and {} in all can be "
                                "read, make it smaller",
                                shown(path), width, height, side, pixels));
    }
    const std::uint64_t bytes = width * height * (bytes_per_pixel + decoder_bytes);
    if (bytes <= kAlwaysThere) return;
    const MemoryLimit limit = memory_limit();
    if (bytes <= limit.available_bytes) return;
    throw Error(ErrorKind::kLimit,
                fmt::format("{}: {}x{} pixels need about {} MiB of memory, but {} leaves {} MiB; "
                            "make it smaller",
                            shown(path), width, height, bytes >> 20, limit.source,
                            limit.available_bytes >> 20));
}

}  // namespace mray::app
