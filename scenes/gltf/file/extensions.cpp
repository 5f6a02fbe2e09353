#include "scenes/gltf/file/extensions.h"

#include <algorithm>
#include <array>
#include <string>

namespace mray::gltf {
namespace {

constexpr std::array kRead = {kQuantization, kTextureTransform, kMeshopt};

// Lights, and how surfaces reflect, emit and let through light.
constexpr std::array<std::string_view, 7> kFamiliesLeftOut = {
    "KHR_lights_",      "EXT_lights_",     "KHR_materials_", "EXT_materials_",
    "ADOBE_materials_", "VRMC_materials_", "MSFT_packing_"};

// Formats of images, which are then missing; shaders of glTF 1, also by the name that COLLADA2GLTF
// gives them; data about the model; sound, physics, behaviour and lines.
constexpr std::array<std::string_view, 25> kLeftOut = {"KHR_texture_basisu",
                                                       "EXT_texture_webp",
                                                       "EXT_texture_avif",
                                                       "MSFT_texture_dds",
                                                       "KHR_techniques_webgl",
                                                       "KHR_technique_webgl",
                                                       "KHR_xmp",
                                                       "KHR_xmp_json_ld",
                                                       "EXT_structural_metadata",
                                                       "EXT_feature_metadata",
                                                       "EXT_mesh_features",
                                                       "EXT_instance_features",
                                                       "AGI_stk_metadata",
                                                       "AGI_articulations",
                                                       "KHR_audio_emitter",
                                                       "MSFT_audio_emitter",
                                                       "KHR_physics_rigid_bodies",
                                                       "KHR_collision_shapes",
                                                       "KHR_interactivity",
                                                       "KHR_node_hoverability",
                                                       "KHR_node_selectability",
                                                       "CESIUM_primitive_outline",
                                                       "EXT_mesh_primitive_edge_visibility",
                                                       "VRM",
                                                       "VRMC_vrm"};

}  // namespace

ExtensionUse use_of_extension(std::string_view name) {
    if (std::find(kRead.begin(), kRead.end(), name) != kRead.end()) return ExtensionUse::kRead;
    const bool is_of_family =
        std::any_of(kFamiliesLeftOut.begin(), kFamiliesLeftOut.end(),
                    [&](std::string_view family) { return name.starts_with(family); });
    if (is_of_family || std::find(kLeftOut.begin(), kLeftOut.end(), name) != kLeftOut.end())
        return ExtensionUse::kLeftOut;
    return ExtensionUse::kUnknown;
}

std::optional<JsonAt> extension_of(const JsonAt& at, std::string_view name) {
    const auto extensions = at.find("extensions");
    return extensions ? extensions->find(std::string(name).c_str()) : std::nullopt;
}

}  // namespace mray::gltf
