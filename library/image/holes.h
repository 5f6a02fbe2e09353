// Holes that textures make in the triangles of lit images.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "common/backend.h"
#include "common/base/thread_arena.h"
#include "cpu/image/shaded_mesh.h"
#include "cpu/image/texture.h"
#include "library/image/image_conversion.h"

namespace morphray::detail {

/// The scene whose rays pass through holes. It must outlive its use.
struct HoledScene {
    mray::cpu::ShadedMesh mesh;
    mray::cpu::TexturedTriangles textures;
    /// It has a tree of the scene.
    mray::Backend& backend;
    mray::ThreadArena& arena;
    /// As View::cancel.
    const std::atomic<bool>* cancel = nullptr;
};

/// Makes of an image that was traced as if there were no holes what a trace through them gives. A
/// hit in a hole is followed by the next hit of its ray, until one is none: camera rays first, then
/// shadow rays and rays of the sky where their number of occluded rays may have changed. Returns
/// the number of rays that this took. Throws what the backend throws, and Error(kCancelled).
std::uint64_t pass_holes(const HoledScene& scene, TracedImage& image);

}  // namespace morphray::detail
