// The two sources of Embree's ray records.
#pragma once

#include <memory>

#include "lab/bench/embree/embree_tracer.h"

namespace mray::bench {

/// Stands for a stream of a tile's single rays where the rays of a packet are counted.
inline constexpr int kStream = 0;

/// Packets of N rays (1, 4, 8, 16 or kStream; 1: single rays) from records that have all been made
/// before. Null for a stream if Embree has none.
template <int N>
std::unique_ptr<EmbreeTracer> trace_from_memory(const TraceWork& work);

/// As above, with each record made when it is traced.
template <int N>
std::unique_ptr<EmbreeTracer> trace_made(const TraceWork& work);

}  // namespace mray::bench
