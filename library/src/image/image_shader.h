// Images of several samples a pixel, lit or in false colours.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/backend.h"
#include "common/base/thread_arena.h"
#include "common/scene/camera_setup.h"
#include "common/scene/vertex_normals.h"
#include "cpu/image/lit_shader.h"
#include "library/src/image/image_conversion.h"
#include "library/src/scene/mesh_list.h"
#include "library/src/scene/pose_reader.h"
#include "morphray/image.hpp"

namespace morphray::detail {

/// Shades on the CPU what any backend has traced, so that colours do not depend on the backend.
/// Not thread-safe.
class ImageShader {
public:
    explicit ImageShader(const mray::SimdTarget& target) : shader_(target) {}

    /// Says that positions, or the meshes as well, are others than before.
    void set_pose() { has_normals_ = false; }
    void set_meshes() {
        normals_.reset();
        has_normals_ = false;
    }

    /// Whether a view needs more than one traced image, or other colours than the backend's.
    static bool is_needed_for(const View& view);

    /// Traces and shades a view of the meshes at the pose, which the backend has a tree of. Fills
    /// pixels, lit_pixels, ray_count, trace_ms and shade_ms of the image. Throws what
    /// make_image_params() and the backend throw; Error(bad_argument) for other numbers of samples
    /// than View::samples allows.
    void render(const View& view, const MeshList& meshes, const PoseReader& pose,
                mray::Backend& backend, mray::ThreadArena& arena, TracedImage& traced,
                Image& image);

private:
    void prepare_normals(const MeshList& meshes, const PoseReader& pose, mray::ThreadArena& arena);

    mray::cpu::LitShader shader_;
    std::optional<mray::VertexNormals> normals_;
    bool has_normals_ = false;
};

}  // namespace morphray::detail
