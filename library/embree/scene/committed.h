// A scene as it was committed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "library/embree/scene/box_tree.h"
#include "library/embree/scene/parts.h"
#include "morphray/scene.hpp"

namespace mray::embree {

/// How a tree is built.
struct BuildWay {
    RTCBuildQuality quality = RTC_BUILD_QUALITY_MEDIUM;
    /// Whether updates refit, whatever the tree is like then.
    bool is_refitted = false;

    bool operator==(const BuildWay&) const = default;
};

/// The scene as queries read it. Its parts are the meshes of `scene`, by geom_id.
struct Committed {
    std::vector<Part> parts;
    /// Nothing if the scene has no triangles.
    std::optional<morphray::Scene> scene;
    BuildWay way;
    bool is_robust = false;
    /// Whether rays are compared with masks: only where the caller has set one.
    bool uses_masks = false;
    /// All different masks on the way to meshes, if they are used.
    std::vector<unsigned int> masks;
    /// Whether a mesh has a filter for hits, or for occlusion.
    bool filters_hits = false;
    bool filters_occlusion = false;

    /// Changes with each read_settings(); no two scenes have the same.
    std::uint64_t settings_number = 0;

    void read_settings();
    /// Whether a ray with this mask passes by no mesh.
    bool all_seen(unsigned int ray_mask) const {
        for (const unsigned int mask : masks)
            if ((mask & ray_mask) == 0) return false;
        return true;
    }
    /// By part, 1 for those that a ray with this mask does not pass by. Valid until the thread's
    /// next call.
    std::span<const std::uint8_t> visible(unsigned int ray_mask) const;
    /// A tree of all primitives, made from the buffers by the first call at a pose. Threads may
    /// call it at the same time.
    const BoxTree& boxes() const;
    void forget_boxes() { made_boxes_ = nullptr; }

private:
    mutable std::mutex boxes_mutex_;
    mutable std::unique_ptr<const BoxTree> made_boxes_;
};

}  // namespace mray::embree
