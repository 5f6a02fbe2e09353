// The part of a render that one shard has done, as it is written beside the shard's images.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/base/shard.h"

namespace mray::app {

/// A further file of a frame, with the XXH3 (64 bits) of its bytes.
struct PartOutput {
    /// Relative to the folder of the part.
    std::string file;
    std::uint64_t hash = 0;
};

/// An image that a shard has rendered, or has kept from an earlier run.
struct PartImage {
    double frame = 0;
    /// Relative to the folder of the part; never outside of it.
    std::string file;
    /// frame_hash() of what it shows; XXH3 of hits and pixels, as images say.
    std::uint64_t scene_hash = 0;
    std::uint64_t hits_hash = 0;
    std::uint64_t image_hash = 0;
    /// OpenEXR file and file of hits, if there are such.
    std::vector<PartOutput> outputs;
    bool is_kept = false;
    /// Where it was rendered, as far as that is known.
    std::string host;
    std::string backend;
    std::string device;
    /// From the begin of the frame to the end of its files; 0 if it was kept.
    double total_ms = 0;
};

/// The facts that the parts of one render share.
struct PartRender {
    /// Program and version, and the command without the shard.
    std::string software;
    std::string source;
    std::string scene;
    std::uint64_t triangles = 0;
    std::uint64_t vertices = 0;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    /// clip_hash().
    std::uint64_t scene_hash = 0;
    std::uint32_t verify_every = 0;
    /// The frames of all shards, ascending.
    std::vector<double> frames;

    bool operator==(const PartRender&) const = default;
};

/// "done"; "partial" if a later frame failed; "interrupted"; "failed"; "running" as long as none of
/// these is known, and so of a shard that was killed.
enum class PartState { kRunning, kDone, kPartial, kInterrupted, kFailed };
const char* name_of(PartState state);

struct Part {
    PartRender render;
    Shard shard;
    PartState state = PartState::kRunning;
    /// The exit code of the program; none while it runs.
    std::optional<int> exit_code;
    /// Why it ended early, or empty.
    std::string reason;
    /// Host, backend and device of the last run.
    std::string host;
    std::string backend;
    std::string device;
    /// Images of the shard's block, and those of the frames that it rendered to check others.
    std::vector<PartImage> images;
    std::vector<PartImage> checks;
    std::vector<double> frames_left;
    std::vector<double> checks_left;
    /// Where the part was read; not written.
    std::filesystem::path folder;
};

/// "part-2-of-8.json".
std::string part_name(const Shard& shard);
/// "check-2-of-8", the folder of the images that the shard renders to check others.
std::string check_folder_name(const Shard& shard);

std::string to_json(const Part& part);

/// The limits of a part that is read.
inline constexpr std::uint64_t kMaxPartBytes = std::uint64_t{64} << 20;

/// Reads a part. Throws Error, with the file: kBadInput for a file that is no part (with the line
/// if it is not JSON), kLimit for one of more than kMaxPartBytes.
Part read_part(const std::filesystem::path& file);

}  // namespace mray::app
