// The binary tree of the peer, built on one thread by binned SAH (I. Wald. On Fast Construction of
// SAH-Based Bounding Volume Hierarchies. RT 2007).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/interop/platform.h"

namespace mray::bench {

struct PeerTree {
    /// kPeerNodeVec4s and kPeerTriangleVec4s of each (peer_interface.h).
    std::vector<vec4> nodes;
    std::vector<vec4> triangles;

    /// The triangle of the scene that is triangle i of the tree.
    std::uint32_t prim_id(std::size_t i) const;
};

/// A tree over triangles with finite vertices; at least one.
PeerTree build_peer_tree(std::span<const uvec3> triangles, std::span<const vec3> positions);

}  // namespace mray::bench
