#include "lab/bench/tinybvh/tinybvh_peer.h"

namespace mray::bench {

std::vector<Peer> tinybvh_peers(const BenchScene&, const TraceWork&) { return {}; }

}  // namespace mray::bench
