// A glTF 2.0 file with its buffers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/warning.h"
#include "scenes/json/json_at.h"

namespace mray::gltf {

/// Bytes of a buffer, and where they are on the disk.
struct Buffer {
    std::string_view bytes;
    /// Empty for a data: URI.
    std::filesystem::path file = {};
    std::uint64_t offset_in_file = 0;
    /// The content of a data: URI, in which `bytes` lie; otherwise null.
    std::shared_ptr<const std::string> data = {};
    /// Its views are compressed ones, whose bytes are elsewhere; it has none itself.
    bool is_placeholder = false;
};

/// The JSON of a .gltf or .glb file and the content of its buffers, from the file, from data: URIs
/// and from files in its folder.
class GltfFile {
public:
    /// Takes from the budget what the JSON takes, and adds 16 times the bytes of the buffers.
    ///
    /// Throws Error: kBadInput with the place in the JSON (other versions, extensions that are
    /// required and unknown, buffers that are missing, outside of the folder or shorter than they
    /// say), kLimit for a file of more than 4 GiB. Warns of extensions that are required and left
    /// out.
    GltfFile(const std::filesystem::path& path, ContentBudget& budget, const WarnFunction& warn);
    GltfFile(const GltfFile&) = delete;
    GltfFile& operator=(const GltfFile&) = delete;

    const std::filesystem::path& path() const { return path_; }
    /// In messages.
    const std::string& name() const { return name_; }
    JsonAt root() const { return {json_, name_}; }
    /// The number of elements of a member such as "nodes"; 0 without it.
    std::size_t count(const char* key) const;
    /// An element of a member that has it.
    JsonAt element(const char* key, std::size_t index) const;

    std::span<const Buffer> buffers() const { return buffers_; }
    /// The bytes of all buffers, those that share a file counted once.
    std::uint64_t buffer_bytes() const { return buffer_bytes_; }
    bool uses_extension(std::string_view extension) const;

private:
    void require_version() const;
    void require_known_extensions(const WarnFunction& warn) const;
    void read_buffers(std::string_view binary_chunk, std::uint64_t chunk_offset);
    Buffer read_buffer(const JsonAt& buffer, std::size_t index, std::string_view binary_chunk,
                       std::uint64_t chunk_offset);

    std::filesystem::path path_;
    std::string name_;
    /// The bytes of a GLB file.
    std::string bytes_;
    JsonTree json_;
    /// Contents by the paths of files.
    std::map<std::filesystem::path, std::string> files_;
    std::vector<Buffer> buffers_;
    std::uint64_t buffer_bytes_ = 0;
};

}  // namespace mray::gltf
