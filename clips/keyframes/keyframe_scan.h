// Reads all keyframes of a clip once.
#pragma once

#include <cstdint>

#include "clips/clip_facts.h"
#include "clips/keyframes/keyframe_cache.h"
#include "clips/keyframes/keyframe_source.h"
#include "common/base/watch.h"

namespace mray {

/// Reads in parallel; memory holds a keyframe a thread, and what `cache` keeps. Keyframes that the
/// cache has are not read. Throws Error(kBadInput) for the first keyframe with another topology,
/// and Error(kCancelled) within a keyframe after the watch asks for it.
ClipFacts scan_keyframes(const KeyframeSource& source, std::uint32_t vertex_count,
                         KeyframeCache& cache, const Watch& watch = {});

}  // namespace mray
