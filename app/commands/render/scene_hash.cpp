#include "app/commands/render/scene_hash.h"

#include "app/files/image_reader.h"
#include "common/base/errors.h"
#include "common/base/hash.h"

namespace mray::app {
namespace {

/// Also the length of an array, so that moving elements to the next one changes the hash.
void add_number(Hasher& hasher, std::uint64_t number) {
    hasher.add(std::span<const std::uint64_t>(&number, 1));
}

template <class T>
void add_array(Hasher& hasher, std::span<const T> values) {
    add_number(hasher, values.size());
    hasher.add(values);
}

std::string bytes_of(const TextureFile& file, bool lenient) {
    try {
        return texture_bytes(file);
    } catch (const Error& error) {
        if (!lenient || error.kind() != ErrorKind::kBadInput) throw;
        return {};
    }
}

void add_textures(Hasher& hasher, const SceneTextures& textures, bool lenient) {
    add_array(hasher, std::span<const Texcoords>(textures.texcoords));
    add_array(hasher, std::span<const std::uint32_t>(textures.texture_ids));
    for (const TextureFile& file : textures.files) {
        add_number(hasher, file.clamp ? 1 : 0);
        hasher.add(std::span(&file.alpha_cutoff, 1));
        const std::string bytes = bytes_of(file, lenient);
        add_array(hasher, std::span<const char>(bytes));
    }
}

}  // namespace

std::uint64_t clip_hash(const Clip& clip, bool with_textures, bool lenient) {
    Hasher hasher;
    const Topology& topology = clip.topology();
    add_number(hasher, topology.vertex_count);
    add_array(hasher, std::span<const uvec3>(topology.triangles));
    add_array(hasher, std::span<const Albedo>(topology.albedo));
    add_array(hasher, clip.smooth_corners());
    const WorldBounds bounds = clip.bounds();
    hasher.add(std::span<const double>(bounds.lower)).add(std::span<const double>(bounds.upper));
    if (with_textures && clip.textures() != nullptr)
        add_textures(hasher, *clip.textures(), lenient);
    return hasher.digest();
}

std::uint64_t frame_hash(std::uint64_t clip_hash, std::span<const vec3> positions) {
    Hasher hasher;
    add_number(hasher, clip_hash);
    return hasher.add(positions).digest();
}

}  // namespace mray::app
