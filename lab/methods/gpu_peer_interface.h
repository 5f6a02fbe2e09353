// The interface of host and kernel of the peer on a Vulkan device.
#ifndef METHODS_GPU_PEER_INTERFACE_H
#define METHODS_GPU_PEER_INTERFACE_H

#include "common/interop/camera.h"

SHARED_BEGIN

// Values of specialisation constant 0: the rays, and whether they need any hit or the closest.
SHARED_CONST uint kPeerCamera = 0u;
SHARED_CONST uint kPeerShadow = 1u;  // from the hits of kPeerCamera
SHARED_CONST uint kPeerRays = 2u;    // closest hits of rays in memory

// A node is four vec4s: the boxes of both children as (lower x, upper x, lower y, upper y) of each
// and (lower z, upper z) of both, then the children: a node, or ~(8 * first triangle + count).
SHARED_CONST uint kPeerNodeVec4s = 4u;
// A triangle is three vertices, the first with its prim_id.
SHARED_CONST uint kPeerTriangleVec4s = 3u;
SHARED_CONST uint kPeerMaxStack = 64u;

struct PeerArguments {
    ImageParams params;
    uint tile_columns;
    /// For kPeerRays.
    uint ray_count;
};

SHARED_END

#endif  // METHODS_GPU_PEER_INTERFACE_H
