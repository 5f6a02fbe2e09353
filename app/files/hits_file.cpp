#include "app/files/hits_file.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <limits>
#include <span>

#include "common/interop/camera.h"

namespace mray::app {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is written as memory is");

struct Header {
    char magic[8] = {'M', 'R', 'H', 'I', 'T', 'S', '1', '\0'};
    std::uint32_t width;
    std::uint32_t height;
    std::uint32_t frame_count = 0;
};
static_assert(sizeof(Header) == 20, "no padding");

template <class T>
void append(std::vector<std::byte>& bytes, std::span<const T> values) {
    const std::span<const std::byte> raw = std::as_bytes(values);
    bytes.insert(bytes.end(), raw.begin(), raw.end());
}

float world_depth(const SceneSpace& space, double scene_depth) {
    constexpr double kLargest = std::numeric_limits<float>::max();
    return static_cast<float>(std::min(space.length_to_world(scene_depth), kLargest));
}

}  // namespace

HitsFile::HitsFile(std::uint32_t width, std::uint32_t height) {
    const Header header{.width = width, .height = height};
    bytes_.resize(sizeof(header));
    std::memcpy(bytes_.data(), &header, sizeof(header));
}

std::uint64_t HitsFile::bytes_per_frame(std::uint32_t width, std::uint32_t height) {
    return std::uint64_t{width} * height * (sizeof(Hit) + sizeof(std::uint32_t));
}

void HitsFile::add(const Frame& frame, const Camera& camera, const SceneSpace& space) {
    std::vector<Hit> hits = frame.hits;
    for (std::uint32_t y = 0; y < frame.height; ++y) {
        for (std::uint32_t x = 0; x < frame.width; ++x) {
            Hit& hit = hits[std::size_t{y} * frame.width + x];
            if (hit.prim_id == kNoPrim) continue;
            const double scale = camera_depth_scale(camera, x, y);
            hit.t = world_depth(space, hit.t * scale);
        }
    }
    append(bytes_, std::span<const Hit>(hits));
    append(bytes_, std::span<const std::uint32_t>(frame.occlusion));
    ++frame_count_;
    std::memcpy(bytes_.data() + offsetof(Header, frame_count), &frame_count_, sizeof(frame_count_));
}

}  // namespace mray::app
