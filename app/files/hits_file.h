// The binary file of all hits of a render.
//
// Little-endian throughout:
//     char[8]  "MRHITS1\0"
//     uint32   width, height, frame count
//     then, frame after frame,
//         width * height times {float32 t, u, v; uint32 prim_id}, row by row from the top: t is the
//             depth along the viewing direction in world space, u and v the weights of the
//             second and third vertex; prim_id 0xFFFFFFFF and the rest 0 for a miss
//         width * height times uint32: occluded secondary rays
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/image/frame.h"
#include "common/scene/scene_space.h"

namespace mray::app {

class HitsFile {
public:
    HitsFile(std::uint32_t width, std::uint32_t height);

    /// The bytes that a frame adds.
    static std::uint64_t bytes_per_frame(std::uint32_t width, std::uint32_t height);

    /// `frame` was traced with `camera`. A t too large for a float becomes the largest one.
    void add(const Frame& frame, const Camera& camera, const SceneSpace& space);
    const std::vector<std::byte>& bytes() const { return bytes_; }

private:
    std::vector<std::byte> bytes_;
    std::uint32_t frame_count_ = 0;
};

}  // namespace mray::app
