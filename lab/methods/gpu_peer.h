// The peer on a Vulkan device: a binary tree, one ray a lane, plain floats.
#pragma once

#include "gpu/shared_device.h"
#include "gpu/vulkan/context.h"
#include "lab/methods/gpu_peer_interface.h"
#include "lab/methods/peer_tree.h"

namespace mray::lab {

/// The kernel that wins on GPUs, over a binary tree by binned SAH. One call at a time.
class GpuPeer {
public:
    /// The tree outlives it and has several leaves, of at most 7 triangles. kPeerCamera and
    /// kPeerShadow trace the image of `params`. set_rays() takes up to `most_rays` rays.
    GpuPeer(std::shared_ptr<gpu::SharedDevice> device, const PeerTree& tree,
            const ImageParams& params, std::size_t most_rays);

    /// Sets the rays of kPeerRays.
    void set_rays(std::span<const Ray> rays);
    /// Traces a mode's rays, those of kPeerShadow from the last kPeerCamera. Returns device ms.
    double trace(std::uint32_t mode);
    /// The hits of kPeerCamera or kPeerRays, with the prim_ids of the scene.
    void read_hits(std::span<Hit> hits);

private:
    std::shared_ptr<gpu::SharedDevice> shared_;
    const PeerTree& tree_;
    ImageParams params_;
    std::uint32_t ray_count_ = 0;
    gpu::Context context_;
    gpu::Transfer transfer_;
    gpu::Buffer nodes_, triangles_, rays_, hits_, occluded_;
    std::vector<gpu::BoundPipeline> pipelines_;
};

}  // namespace mray::lab
