// Who is right when several shards rendered a frame differently.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "app/commands/merge/merge_parts.h"

namespace mray::app {

/// An image of a frame as one shard rendered it.
struct Opinion {
    std::uint32_t shard = 0;
    std::string host;
    std::uint64_t image_hash = 0;
    std::uint64_t hits_hash = 0;

    bool agrees_with(const Opinion& other) const {
        return image_hash == other.image_hash && hits_hash == other.hits_hash;
    }
};

/// The opinions that are wrong: those that differ from what more than half of them agree on. All of
/// them if there is no such majority, and none if all agree.
struct Verdict {
    std::vector<Opinion> wrong;
    bool is_decided = true;
};
Verdict judge(std::span<const Opinion> opinions);

/// Counts the verdict against shards and hosts.
void add_suspects(const Verdict& verdict, std::vector<Suspect>& suspects);

}  // namespace mray::app
