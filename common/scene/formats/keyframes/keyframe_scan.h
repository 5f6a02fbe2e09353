// Reads all keyframes of a clip once.
#pragma once

#include <cstdint>

#include "common/scene/formats/keyframes/clip_facts.h"
#include "common/scene/formats/keyframes/keyframe_cache.h"
#include "common/scene/formats/keyframes/keyframe_source.h"

namespace mray {

/// Reads in parallel; memory holds a keyframe a thread, and what `cache` keeps. Keyframes that the
/// cache has are not read. Throws Error(kBadInput) for the first keyframe with another topology.
ClipFacts scan_keyframes(const KeyframeSource& source, std::uint32_t vertex_count,
                         KeyframeCache& cache);

}  // namespace mray
