// Colours of textures at any texture coordinates and of samples of a scene.
#pragma once

#include "cpu/image/texture.h"

namespace mray::test {

/// Texture::colour_within() at any texture coordinates.
inline uvec3 colour_at(const cpu::Texture& texture, Texcoord at, std::uint32_t level) {
    return texture.colour_within(texture.into_image(at.u), texture.into_image(1.0f - at.v), level);
}

/// The linear colour of the sample's texture.
inline uvec3 texture_colour(const cpu::TexturedTriangles& triangles,
                            const cpu::TexturedSample& sample) {
    const cpu::TextureLookup place = cpu::texture_lookup(triangles, sample);
    return place.texture->colour_within(place.u, place.v, place.level);
}

}  // namespace mray::test
