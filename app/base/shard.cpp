#include "app/base/shard.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "common/base/errors.h"
#include "common/text/number_text.h"

namespace mray::app {
namespace {

// How many other shards render a frame again.
constexpr std::uint32_t kOpinions = 2;

}  // namespace

Shard parse_shard(std::string_view option, std::string_view text) {
    const std::size_t slash = text.find('/');
    std::optional<std::uint64_t> index;
    std::optional<std::uint64_t> count;
    if (slash != text.npos) {
        index = parse_unsigned(text.substr(0, slash));
        count = parse_unsigned(text.substr(slash + 1));
    }
    if (!index || !count || *index < 1 || *index > *count || *count > kMaxShards) {
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("{}: '{}' is not I/N with I from 1 to N, and N at most {}", option,
                                text, kMaxShards));
    }
    return {static_cast<std::uint32_t>(*index), static_cast<std::uint32_t>(*count)};
}

Block block_of(std::size_t frames, const Shard& shard) {
    return {frames * (shard.index - 1) / shard.count, frames * shard.index / shard.count};
}

std::uint32_t owner_of(std::size_t frames, std::size_t i, std::uint32_t count) {
    // The least I with i < floor(frames * I / count).
    return static_cast<std::uint32_t>(((i + 1) * count + frames - 1) / frames);
}

std::vector<std::size_t> checked_frames(std::size_t frames, const Shard& shard,
                                        std::uint32_t every) {
    std::vector<std::size_t> places;
    if (every == 0) return places;
    const std::uint32_t opinions = std::min(kOpinions, shard.count - 1);
    for (std::size_t i = 0; i < frames; i += every) {
        const std::uint32_t owner = owner_of(frames, i, shard.count);
        const std::uint32_t after = (shard.index + shard.count - owner) % shard.count;
        if (after >= 1 && after <= opinions) places.push_back(i);
    }
    return places;
}

}  // namespace mray::app
