// What is behind a Scene, for commands that compare and measure backends. All is in scene space.
#pragma once

#include "common/backend.h"
#include "common/scene/camera_setup.h"
#include "morphray/images.hpp"
#include "morphray/scene.hpp"

namespace morphray::engine {

/// The backend of the scene. SceneOptions::cancel ends its images, too.
mray::Backend& backend(const Scene& scene);
/// A copy of the backend on another device, which borrows the scene's pose: the scene must outlive
/// it and keep its meshes. After each update of the scene or read_positions() call refit() or
/// set_tree() first. Throws mray::Error.
std::unique_ptr<mray::Backend> copy_on(const Device& device, const Scene& scene);

/// Reads the positions of all deforming meshes, but leaves the tree as it is. A refit of kAll must
/// follow before the scene is updated.
void read_positions(const Scene& scene);
/// The positions that were read last, and their space.
std::span<const mray::vec3> positions(const Scene& scene);
const mray::SceneSpace& space(const Scene& scene);

/// A view relative to the origin.
mray::ViewSpec to_spec(const View& view, const Point& origin);
/// The parameters of an image of the positions that were read last.
mray::ImageParams image_params(const Scene& scene, const View& view);

/// The index among vulkan_devices() of the device that VulkanOptions::device names. Throws Error.
std::uint32_t device_index(const std::string& device);

}  // namespace morphray::engine
