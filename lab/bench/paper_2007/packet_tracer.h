// Based on: I. Wald, S. Boulos, P. Shirley. Ray tracing deformable scenes using dynamic bounding
// volume hierarchies. ACM Transactions on Graphics 26(1). 2007.
//
// The paper's traversal as it stands there, with vectors of 16 where it had 4. Changed: triangles
// are intersected by the planes through the common origin and their edges, set up once a packet.
// Its rounding is its own, so hits differ from ours as rarely as Embree's.
#pragma once

#include "lab/bench/paper_2007/packet.h"
#include "lab/bench/paper_2007/sweep_tree.h"

namespace mray::bench::paper_2007 {

void trace_closest(const Tree& tree, const PacketRays& rays, PacketAnswers& answers);
void trace_any(const Tree& tree, const PacketRays& rays, PacketAnswers& answers);

}  // namespace mray::bench::paper_2007
