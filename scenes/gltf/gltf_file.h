// A glTF 2.0 file with its buffers and the numbers in them, and what its URIs name.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <vector>

#include "common/base/errors.h"
#include "scenes/json/json_at.h"

namespace mray::gltf {

/// Moves, turns and scales the texture coordinates of a texture.
inline constexpr std::string_view kTextureTransform = "KHR_texture_transform";

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

/// All numbers of an accessor with `width` numbers an element (3 of a VEC3) and `vertex_count`
/// elements, unless that is 0: floats, or integers of 8 or 16 bits. Of those that are normalised,
/// c / 127, c / 255, ... in float, at least -1. Throws Error(kBadInput) with the place that is
/// wrong, as integers() does.
std::vector<float> floats(const GltfFile& file, const JsonAt& reference, std::size_t width,
                          std::size_t vertex_count = 0);

/// Not normalised; 32 bits only for a `width` of 1.
std::vector<std::uint32_t> integers(const GltfFile& file, const JsonAt& reference,
                                    std::size_t width, std::size_t vertex_count);

}  // namespace mray::gltf
