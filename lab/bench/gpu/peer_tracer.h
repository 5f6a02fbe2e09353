// The peer on a Vulkan device: the kernel that wins on GPUs, over a binary tree by binned SAH.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "gpu/shared_device.h"
#include "gpu/transfer.h"
#include "lab/bench/gpu/peer_interface.h"
#include "lab/bench/peer_tree.h"

namespace mray::bench {

class PeerTracer {
public:
    /// Uses the device's queue beside morphray's backend. The tree has at most 7 triangles a leaf,
    /// and more than one leaf. `rays` are those of kPeerRays.
    PeerTracer(std::shared_ptr<gpu::SharedDevice> device, const PeerTree& tree,
               const ImageParams& params, std::span<const Ray> rays);

    /// Traces the rays of a mode once, those of kPeerShadow from the hits of the last kPeerCamera.
    /// Returns milliseconds on the device.
    double trace(std::uint32_t mode);
    /// Copies this many bytes on the device, and returns milliseconds.
    double copy(std::uint64_t bytes);

    /// The hits of kPeerCamera or kPeerRays, with the prim_ids of the scene.
    std::vector<Hit> hits(std::size_t count);

private:
    std::shared_ptr<gpu::SharedDevice> shared_;
    const PeerTree& tree_;
    ImageParams params_;
    std::uint32_t ray_count_;
    gpu::Context context_;
    gpu::Transfer transfer_;
    gpu::Buffer nodes_, triangles_, rays_, hits_, occluded_;
    /// Grown when they are needed.
    gpu::Buffer from_, to_;
    std::vector<gpu::BoundPipeline> pipelines_;
};

}  // namespace mray::bench
