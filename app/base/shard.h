// Parts of the frames of a render, one for each machine of a farm.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace mray::app {

/// The index-th of `count` parts; index is in [1, count].
struct Shard {
    std::uint32_t index = 1;
    std::uint32_t count = 1;
    bool operator==(const Shard&) const = default;
};

inline constexpr std::uint32_t kMaxShards = 65536;

/// "I/N" as the value of an option. Throws Error(kBadArgument) that names it.
Shard parse_shard(std::string_view option, std::string_view text);

/// Places [begin, end) in a list of frames.
struct Block {
    std::size_t begin = 0;
    std::size_t end = 0;
    bool operator==(const Block&) const = default;
};

/// The frames of a shard: one block, so that its tree is refitted from frame to frame and its files
/// are read in order. Blocks are those of floor(frames * I / N): their sizes differ by one at most,
/// and some are empty if there are more shards than frames.
Block block_of(std::size_t frames, const Shard& shard);

/// The shard, from 1 to `count`, in whose block the frame at place `i` < frames is.
std::uint32_t owner_of(std::size_t frames, std::size_t i, std::uint32_t count);

/// The places of the frames that a shard renders again, ascending: of every `every`-th frame (none
/// if that is 0) those of the two shards before it, in a circle, so that three shards render such a
/// frame; of the one before if there are only two.
std::vector<std::size_t> checked_frames(std::size_t frames, const Shard& shard,
                                        std::uint32_t every);

}  // namespace mray::app
