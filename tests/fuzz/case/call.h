// A call of the public interface, as a step of a case.
#pragma once

#include <array>
#include <cstdint>

namespace mray::fuzz {

/// The calls on one of a few scenes that live at the same time. What a call does in detail is drawn
/// from its seed, so that each has a meaning after any calls before it; without a scene most have
/// no effect.
enum class CallKind {
    kBuild,    ///< Builds the scene again, of `number` meshes.
    kDestroy,  ///< Destroys it.
    kOn,       ///< Makes it a copy of scene `number` on a device.
    kAttach,   ///< Attaches a mesh.
    kDetach,   ///< Detaches the mesh with the geom_id `number`.
    kMove,     ///< Writes other positions into the caller's array of mesh `number`.
    kUpdate,   ///< Updates the scene.
    kPart,     ///< Updates a part of mesh `number`.
    kRays,     ///< Asks all questions about `number` rays.
    kPoints,   ///< Asks all questions about `number` points.
    kImage,    ///< Renders an image, `number` pixels wide.
};
/// By kind, as text files of cases have them.
inline constexpr std::array kCallWords = {"build",  "destroy", "on",   "attach", "detach", "move",
                                          "update", "part",    "rays", "points", "image"};

/// Scenes of a case are 0, 1, ...
inline constexpr std::uint32_t kCallScenes = 3;

struct Call {
    CallKind kind = CallKind::kUpdate;
    std::uint32_t scene = 0;
    std::uint32_t number = 0;
    std::uint64_t seed = 0;
    bool operator==(const Call&) const = default;
};

}  // namespace mray::fuzz
