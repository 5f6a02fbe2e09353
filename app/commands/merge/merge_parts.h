// The check of the parts of a render by `morphray merge`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "app/farm/part.h"

namespace mray::app {

enum class FindingKind {
    kMissingPart,   // a shard without a part
    kUnfinished,    // a part of a shard that has not ended, or ended early
    kDiffers,       // a part of another scene, other options or another version
    kMissing,       // a frame without an image
    kDuplicate,     // a frame, or a shard, that is there several times
    kDamaged,       // a file that is missing, damaged, or not what its part says
    kDisagreement,  // a frame that shards rendered differently
    kUnverified,    // a frame that should have been checked by another shard and was not
};

/// "missing part", "unfinished", "differs", ...
const char* name_of(FindingKind kind);

/// Something that is wrong.
struct Finding {
    FindingKind kind = FindingKind::kMissing;
    /// A line without the place.
    std::string text;
    /// The shard (0: none) and the host that it is about, if any.
    std::uint32_t shard = 0;
    std::string host;
    /// The frame that it is about.
    std::optional<double> frame;
};

/// A shard or host that the comparisons point at.
struct Suspect {
    std::uint32_t shard = 0;
    std::string host;
    /// Frames in which it was outvoted by two others, and frames in which it is one of two.
    std::uint32_t outvoted = 0;
    std::uint32_t undecided = 0;
};

/// A frame and the file of its image.
struct MergedFrame {
    double frame = 0;
    std::filesystem::path file;
};

struct MergeReport {
    /// Ordered by shard.
    std::vector<Part> parts;
    std::vector<Finding> findings;
    std::vector<Suspect> suspects;
    /// Frames whose image is whole and there once, ascending.
    std::vector<MergedFrame> frames;
    /// Comparisons of a frame with the image of another shard, and those where both were rendered
    /// on one host.
    std::uint64_t comparisons = 0;
    std::uint64_t same_host = 0;

    bool is_right() const { return findings.empty(); }
    /// The part that all are compared with: the first one that knows its scene. A shard that ends
    /// while its scene opens leaves a part that does not; the first part if none does.
    const Part& first() const;
};

/// Reads the parts in the folders. Throws Error: kBadInput for a folder that cannot be read or has
/// no part, and what read_part() throws.
std::vector<Part> read_parts(const std::vector<std::string>& folders);

/// Checks that the parts are those of one render, that every frame is there once and whole, that
/// files have the recorded hashes, and that shards agree on the frames that several rendered.
/// `parts` is not empty.
MergeReport check_parts(std::vector<Part> parts);

std::string to_text(const MergeReport& report);
std::string to_json(const MergeReport& report);

}  // namespace mray::app
