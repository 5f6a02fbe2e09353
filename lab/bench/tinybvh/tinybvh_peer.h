// tinybvh's BVH8_CPU, its fastest tree for single rays, as a peer, if its header was given when the
// benchmark was built.
#pragma once

#include <vector>

#include "lab/bench/bench_scene.h"
#include "lab/bench/peer.h"

namespace mray::bench {

/// One peer of one ray a call, a group of its own; none without the header. The tree is built here,
/// with spatial splits; work and scene outlive the peer. tinybvh has rays of its own kind, which
/// are made within the time, with reciprocals of directions, from rays of 32 bytes.
std::vector<Peer> tinybvh_peers(const BenchScene& scene, const TraceWork& work);

}  // namespace mray::bench
