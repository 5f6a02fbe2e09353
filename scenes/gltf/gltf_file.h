// A glTF 2.0 file with its buffers and the numbers in them, and what its URIs name.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <vector>

#include "common/base/errors.h"
#include "scenes/json/json_at.h"

namespace mray::gltf {

/// Allows positions and directions of 8 and 16 bits.
inline constexpr std::string_view kQuantization = "KHR_mesh_quantization";
/// Moves, turns and scales the texture coordinates of a texture.
inline constexpr std::string_view kTextureTransform = "KHR_texture_transform";
/// Of nodes: one mesh in many places.
inline constexpr std::string_view kInstancing = "EXT_mesh_gpu_instancing";

/// Returns what the extension of this name says of an object; nothing if it says nothing.
std::optional<JsonAt> extension_of(const JsonAt& at, std::string_view name);

/// The bytes of a "data:" URI, which throws Error(kBadInput) unless in base 64; nothing for others.
std::optional<std::string> data_of_uri(const JsonAt& uri);

/// The file that a relative URI names (RFC 3986: %20 is a blank) in the folder of `scene_file`.
/// Throws Error(kBadInput) for a URI such as "http://", and what side_file() throws.
std::filesystem::path file_of_uri(const JsonAt& uri, const std::filesystem::path& scene_file);

struct Buffer {
    std::string_view bytes = {};
    /// Empty for a data: URI.
    std::filesystem::path file = {};
    std::uint64_t offset_in_file = 0;
    /// The content of a data: URI, in which `bytes` lie; otherwise null.
    std::shared_ptr<const std::string> data = {};
};

struct View {
    JsonAt at;
    const Buffer& buffer;
    std::string_view bytes;
    std::uint64_t offset = 0;
};

/// The JSON of a file and the content of its buffers, from data: URIs and files in its folder.
class GltfFile {
public:
    /// Throws Error: kBadInput with the place in the JSON, kLimit for a file of more than 4 GiB.
    /// Warns of extensions that are required and left out.
    GltfFile(const std::filesystem::path& path, const WarnFunction& warn);
    GltfFile(const GltfFile&) = delete;
    GltfFile& operator=(const GltfFile&) = delete;

    const std::filesystem::path& path() const { return path_; }
    const std::string& name() const { return name_; }  // in messages
    JsonAt root() const { return {json_, name_}; }
    /// The number of elements of a member such as "nodes"; 0 without it.
    std::size_t count(const char* key) const;
    JsonAt element(const char* key, std::size_t index) const;

    /// The buffer view that a member refers to. Throws Error(kBadInput) if it is not in its buffer.
    View view(const JsonAt& reference) const;
    /// The bytes of all buffers, those that share a file counted once.
    std::uint64_t buffer_bytes() const { return buffer_bytes_; }
    bool uses_extension(std::string_view extension) const;

private:
    void require_version() const;
    void require_known_extensions(const WarnFunction& warn) const;
    /// `binary_chunk` has no data if it is not this buffer's.
    Buffer read_buffer(const JsonAt& buffer, std::string_view binary_chunk);

    std::filesystem::path path_;
    std::string name_;
    /// The bytes of a GLB file.
    std::string bytes_;
    JsonTree json_;
    std::map<std::filesystem::path, std::string> files_;
    std::vector<Buffer> buffers_;
    std::uint64_t buffer_bytes_ = 0;
};

/// The elements that a reader of numbers accepts.
struct Wanted {
    /// The numbers of an element: 1 of a SCALAR, 3 of a VEC3, 16 of a MAT4.
    std::size_t width = 1;
    /// Whether integers are accepted: those that are normalised, or any.
    enum class Integers { kNone, kNormalized, kAny } integers = Integers::kNone;
    /// The vertices of a primitive, each of which has an element; 0: any number of elements.
    std::size_t vertex_count = 0;
};

/// All numbers of an accessor. Of integers that are normalised, c / 127, c / 255, ... in float, at
/// least -1. Throws Error(kBadInput) with the place that is wrong, as integers() does.
std::vector<float> floats(const GltfFile& file, const JsonAt& reference, const Wanted& wanted);

/// Not normalised; 32 bits only for a `width` of 1. `vertex_count` is that of Wanted.
std::vector<std::uint32_t> integers(const GltfFile& file, const JsonAt& reference,
                                    std::size_t width, std::size_t vertex_count);

}  // namespace mray::gltf
