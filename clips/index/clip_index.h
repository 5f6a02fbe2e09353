// The content of an index file of a clip, and its bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "clips/clip_facts.h"

namespace mray {

/// The first bytes of an index file.
inline constexpr std::array<char, 8> kIndexMagic = {'M', 'R', 'I', 'N', 'D', 'E', 'X', '\n'};

/// A file that keyframes are read from.
struct IndexedFile {
    /// Without its folder.
    std::string name;
    std::uint64_t size = 0;
    /// Time of the last change, in nanoseconds since 1970.
    std::int64_t modified_ns = 0;
    /// XXH3 (64 bits) of the content.
    std::uint64_t hash = 0;
};

struct ClipIndex {
    /// topology_hash() of the clip's triangles.
    std::uint64_t topology_hash = 0;
    std::uint32_t vertex_count = 0;
    /// The options of the scene with which the keyframes were read.
    bool lenient = false;
    bool allow_empty = false;
    std::vector<IndexedFile> files;
    ClipFacts facts;
};

/// The bytes of an index file, all numbers little-endian (docs/design/clips.md has the layout).
std::vector<std::byte> encode_index(const ClipIndex& index);

/// The index with these bytes. Accepts nothing but what encode_index() makes. Memory grows with the
/// bytes, whatever they say. Throws Error(kBadInput) whose text goes on from the file's name: "is
/// not an index", "has version 2; only 1 is known", "is damaged".
ClipIndex decode_index(std::span<const std::byte> bytes);

}  // namespace mray
