// Renders of small clips in shards.
#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/app/program.h"

namespace mray::test {

using Json = nlohmann::ordered_json;
using Names = std::vector<std::string>;

/// `morphray render` of eight frames of a small scene into a folder.
inline Names render_of(const TemporaryFolder& folder, const std::string& out,
                       const Names& more = {}) {
    Names all = {
        "render", "builtin:cloth:300", "--frames", "0..7", "--size", "24x20",         "--rays",
        "shadow", "--threads",         "1",        "-q",   "--out",  folder.file(out)};
    if (std::find(more.begin(), more.end(), "--backend") == more.end())
        all.insert(all.end(), {"--backend", "cpu"});
    all.insert(all.end(), more.begin(), more.end());
    return all;
}

/// The same, as one shard on a node of this name.
inline Outcome render_shard(const TemporaryFolder& folder, const std::string& out,
                            const std::string& shard, const Names& more = {},
                            const std::string& host = "") {
    Names all = {"--shard", shard};
    all.insert(all.end(), more.begin(), more.end());
    const std::string node =
        host.empty() ? std::string("n").append(shard, 0, shard.find('/')) : host;
    return run(render_of(folder, out, all), {.environment = {"SLURMD_NODENAME=" + node}});
}

/// All shards of a render into one folder.
inline void render_shards(const TemporaryFolder& folder, const std::string& out, int count,
                          const Names& more = {}) {
    for (int i = 1; i <= count; ++i) {
        const std::string shard = std::to_string(i) + '/' + std::to_string(count);
        const Outcome outcome = render_shard(folder, out, shard, more);
        ASSERT_EQ(outcome.code, 0) << outcome.err;
    }
}

inline Json read_json(const TemporaryFolder& folder, const std::string& file) {
    return Json::parse(read_file(folder.path() / file));
}

inline Outcome merge(const TemporaryFolder& folder, Names arguments) {
    arguments.insert(arguments.begin(), "merge");
    return run(arguments, {.folder = folder.path()});
}

}  // namespace mray::test
