// A farm whose workers are killed at random moments: `merge` tells what is missing, and the same
// command again repairs it.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <random>
#include <thread>

#include "tests/faults/works.h"

namespace mray::test {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kShardCount = 3;

std::vector<std::string> shard_arguments(int shard) {
    return {"render",    "builtin:cloth:2000",
            "--frames",  "0..11",
            "--size",    "96x96",
            "--backend", "cpu",
            "--threads", "1",
            "--out",     "out",
            "--quiet",   "--hits",
            "hits/",     "--skip-existing",
            "--shard",   std::to_string(shard) + "/" + std::to_string(kShardCount)};
}

/// Without what a killed worker may leave, which the next one removes.
Outputs finished_outputs_of(const TemporaryFolder& folder) {
    Outputs outputs = outputs_of(folder);
    std::erase_if(outputs, [](const auto& file) {
        return file.first.find(".morphray-") != std::string::npos;
    });
    return outputs;
}

Outcome merge(const TemporaryFolder& folder) {
    return run({"merge", "out"}, {.folder = folder.path()});
}

TEST(KilledWorkers, AreRepairedByTheSameCommands) {
    TemporaryFolder undisturbed;
    const Clock::time_point begin = Clock::now();
    for (int shard = 1; shard <= kShardCount; ++shard)
        ASSERT_EQ(run(shard_arguments(shard), {.folder = undisturbed.path()}).code, 0);
    const Clock::duration length = (Clock::now() - begin) / kShardCount;
    const Outcome merged = merge(undisturbed);
    ASSERT_EQ(merged.code, 0) << merged.out << merged.err;
    const Outputs complete = outputs_of(undisturbed);

    std::mt19937 random(1);
    std::uniform_real_distribution<double> part(0.0, 1.5);
    const int rounds = std::getenv("MORPHRAY_EVERY_FAULT") != nullptr ? 200 : 3;
    for (int round = 0; round < rounds; ++round) {
        SCOPED_TRACE(round);
        TemporaryFolder folder;
        std::vector<std::unique_ptr<Started>> workers;
        for (int shard = 1; shard <= kShardCount; ++shard)
            workers.push_back(std::make_unique<Started>(shard_arguments(shard),
                                                        Surroundings{.folder = folder.path()}));
        bool all_done = true;
        for (const auto& worker : workers) {
            std::this_thread::sleep_for(
                std::chrono::duration_cast<Clock::duration>(length * part(random)));
            worker->send(SIGKILL);
            const Outcome ended = worker->wait();
            EXPECT_TRUE(ended.code == 0 || ended.code == 128 + SIGKILL) << ended.code << ended.err;
            all_done = all_done && ended.code == 0;
        }
        const Outputs finished = finished_outputs_of(folder);
        expect_whole(finished, complete);
        const bool has_part = std::ranges::any_of(
            finished, [](const auto& file) { return file.first.ends_with(".json"); });
        const Outcome found = merge(folder);
        // A worker can be killed when it has written all.
        const bool may_be_whole = finished.size() == complete.size();
        EXPECT_TRUE(found.code == 0 ? may_be_whole : !all_done) << found.out;
        if (found.code != 0) {
            EXPECT_EQ(found.code, has_part ? 1 : 3) << found.out << found.err;
        }
        for (int shard = 1; shard <= kShardCount; ++shard)
            EXPECT_EQ(run(shard_arguments(shard), {.folder = folder.path()}).code, 0);
        const Outcome repaired = merge(folder);
        EXPECT_EQ(repaired.code, 0) << repaired.out << repaired.err;
        const Outputs outputs = outputs_of(folder);
        EXPECT_EQ(outputs.size(), complete.size());
        expect_whole(outputs, complete);
    }
}

}  // namespace
}  // namespace mray::test
