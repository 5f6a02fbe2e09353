// Index files: where they are, whether they are of a clip, and how they are made.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "clips/clip.h"
#include "clips/clip_options.h"
#include "clips/index/clip_index.h"

namespace mray {

/// The index file of a scene: the scene's name and ".mrindex", without the slashes at a folder's
/// end, with # for the frame number of a pattern; for a point cache the cache's name and
/// ".mrindex".
std::filesystem::path default_index_path(const std::string& scene, const std::string& cache);

/// The facts of a clip that its index must agree with.
struct IndexedClip {
    std::uint64_t topology_hash = 0;
    std::uint32_t vertex_count = 0;
    std::size_t keyframe_count = 0;
    std::span<const std::filesystem::path> files;
    /// The bounds of keyframe 0, if it has been read.
    std::optional<KeyframeBounds> first_bounds;
};

struct FoundIndex {
    IndexUse use = {};
    /// If use.state is kUsed.
    std::optional<ClipIndex> index = {};
};

/// Reads the index that the options name, or the default one where there is one. An index that
/// cannot be used is stale: damaged, of another version, or of files whose names, sizes or times of
/// change are others now. Throws Error(kBadInput) if the options name one that cannot be read.
FoundIndex find_index(const std::string& scene, const ClipOptions& options,
                      const IndexedClip& clip);

/// Looks at the files and hashes them. Throws Error(kBadInput).
std::vector<IndexedFile> stamp_files(std::span<const std::filesystem::path> files);

/// Whether a file begins as index files do. False if it cannot be read.
bool is_index_file(const std::filesystem::path& path);

/// Reads an index file. Throws Error(kBadInput) with the file.
ClipIndex read_index_file(const std::filesystem::path& path);

}  // namespace mray
