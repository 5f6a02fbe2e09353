// Keyframes on the device.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "common/scene/scene_keyframes.h"
#include "gpu/texel_buffer.h"
#include "gpu/vulkan/transfer.h"

namespace morphray::gpu {

/// The two keyframes that poses are interpolated between, one behind the other in one buffer.
class KeyframeSlots {
public:
    KeyframeSlots(Context& context, std::uint32_t vertex_count);

    const TexelBuffer& texels() const { return texels_; }

    bool holds(const SceneKeyframes& keyframes, std::size_t index) const {
        return slot_of(keyframes, index).has_value();
    }
    /// Uploads what is not there of the keyframes before and after a pose; nothing that reads them
    /// may be under way then. After an exception those that had to go are not there.
    void load(Transfer& transfer, const KeyframePose& pose);
    /// Where a keyframe that is there begins, in texels.
    std::uint32_t first_texel(const SceneKeyframes& keyframes, std::size_t index) const;

private:
    std::optional<std::uint32_t> slot_of(const SceneKeyframes& keyframes, std::size_t index) const;

    std::uint32_t vertex_count_;
    TexelBuffer texels_;
    const SceneKeyframes* source_ = nullptr;
    std::array<std::optional<std::size_t>, 2> held_;
};

}  // namespace morphray::gpu
