// Based on: I. Wald, S. Boulos, P. Shirley. Ray tracing deformable scenes using dynamic bounding
// volume hierarchies. ACM Transactions on Graphics 26(1). 2007.
//
// The paper's traversal as it stands there, with vectors as wide as the processor's where it had 4.
// Changed: triangles are intersected by the planes through the common origin and their edges, set
// up once a packet. Its rounding is its own, so hits differ from ours as rarely as Embree's.
#pragma once

#include "lab/methods/peer_tree.h"
#include "lab/methods/tracers.h"

namespace mray::lab {

/// For tiles of rays with a common origin, whose packets are made before. Compiled for the best
/// instruction set, as our own tracers are.
Tracer paper_tracer(const PeerTree& tree, const RaySet& set);

}  // namespace mray::lab
