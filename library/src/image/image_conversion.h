// Conversions of views and images between the public interface and backends.
#pragma once

#include "common/base/thread_arena.h"
#include "common/base/watch.h"
#include "common/image/frame.h"
#include "common/scene/camera_setup.h"
#include "common/scene/scene_space.h"
#include "library/src/scene/mesh_list.h"
#include "morphray/image.hpp"

namespace morphray::detail {

mray::ViewSpec to_spec(const View& view);

/// The results of a backend for an image. The next image may use their memory again.
struct TracedImage {
    /// Parameters of the samples: width and height are those of the image times the side of a
    /// pixel's square.
    mray::ImageParams params = {};
    mray::Frame samples;
    /// The same samples with ambient-occlusion rays, if `has_sky`; else those of an image before.
    mray::Frame sky;
    bool has_sky = false;
};

/// Fills hits, occlusion and both hashes of an image whose pixels are there; without hits as
/// View::hits says. Takes the occlusion out of `traced`. Throws Error(kCancelled) between rows.
void fill_hits(bool with_hits, TracedImage& traced, const mray::SceneSpace& space,
               const MeshList& meshes, mray::ThreadArena& arena, const mray::Watch& watch,
               Image& image);

}  // namespace morphray::detail
