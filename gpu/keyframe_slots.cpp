#include "gpu/keyframe_slots.h"

#include <algorithm>
#include <cassert>
#include <vector>

namespace morphray::gpu {

KeyframeSlots::KeyframeSlots(Context& context, std::uint32_t vertex_count)
    : vertex_count_(vertex_count),
      texels_(context, "keyframes", 2 * kPaddedBytes * vertex_count, VK_FORMAT_R32G32B32A32_UINT) {}

std::optional<std::uint32_t> KeyframeSlots::slot_of(const SceneKeyframes& keyframes,
                                                    std::size_t index) const {
    const auto slot = std::find(held_.begin(), held_.end(), index);
    if (source_ != &keyframes || slot == held_.end()) return std::nullopt;
    return static_cast<std::uint32_t>(slot - held_.begin());
}

void KeyframeSlots::load(Transfer& transfer, const KeyframePose& pose) {
    const SceneKeyframes& keyframes = *pose.keyframes;
    assert(keyframes.vertex_count() == vertex_count_);
    if (source_ != &keyframes) held_ = {};
    source_ = &keyframes;
    const std::size_t wanted[] = {pose.blend.before, pose.blend.after};
    std::vector<vec3> points;
    for (const std::size_t index : wanted) {
        if (slot_of(keyframes, index)) continue;
        const std::size_t slot = held_[0] == wanted[0] || held_[0] == wanted[1] ? 1 : 0;
        held_[slot].reset();
        points.resize(vertex_count_);
        keyframes.write(index, points);
        transfer.upload_padded(points, texels_.buffer, slot * kPaddedBytes * vertex_count_);
        held_[slot] = index;
    }
}

std::uint32_t KeyframeSlots::first_texel(const SceneKeyframes& keyframes, std::size_t index) const {
    const std::optional<std::uint32_t> slot = slot_of(keyframes, index);
    assert(slot);
    return *slot * vertex_count_;
}

}  // namespace morphray::gpu
