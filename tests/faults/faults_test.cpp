// What goes wrong around the program: allocations fail, and it is killed while it writes. Files
// that are there are whole.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <new>
#include <optional>
#include <thread>

#include "common/base/thread_arena.h"
#include "tests/faults/whole_files.h"

thread_local bool memory_is_out = false;

// Not inlined, since g++ would take malloc() and free() for a mismatch.
[[gnu::noinline]] void* operator new(std::size_t size) {
    void* const memory = memory_is_out ? nullptr : std::malloc(size);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace mray::test {
namespace {

Outcome run_without(int allocation, const std::vector<std::string>& command,
                    const TemporaryFolder& folder) {
    return run(command,
               {.input = "0 9 0 0 -1 0\n",
                .environment = {"LD_PRELOAD=" FAILING_ALLOCATION,
                                "MORPHRAY_FAILING_ALLOCATION=" + std::to_string(allocation)},
                .folder = folder.path()});
}

void expect_limit(const Outcome& outcome) {
    EXPECT_TRUE(outcome.code == 0 || outcome.code == 6) << outcome.code << ": " << outcome.err;
    EXPECT_EQ(lines(outcome.err).size(), outcome.code == 6 ? 1u : 0u) << outcome.err;
}

TEST(Faults, AFailingAllocationIsALimit) {
    const Outputs complete = outputs_of_a_run();
    bool is_any = false;
    for (int allocation = 0; allocation < 12'000; allocation += 307) {
        SCOPED_TRACE(allocation);
        const TemporaryFolder folder;
        const Outcome outcome = run_without(allocation, kWork, folder);
        expect_limit(outcome);
        is_any = is_any || outcome.code == 6;
        expect_whole(outputs_of(folder), complete);
    }
    EXPECT_TRUE(is_any);
}

TEST(Faults, AFailingAllocationOfAnyCommandIsALimit) {
    const std::vector<std::vector<std::string>> commands = {
        {"crosscheck", "builtin:cloth:200", "--frames", "0..1", "--size", "8x8", "--backend", "cpu",
         "--queries", "9", "--json", "a.json", "--junit", "a.xml", "--html", "a.html", "-q"},
        {"profile", "builtin:cloth:500", "--frames", "0..1", "--size", "8x8", "--backend", "cpu",
         "--repeat", "1", "--json", "a.json", "-q"},
        {"trace", "builtin:cloth:500", "--rays", "-", "--out", "a.txt", "--all"},
        {"info", "builtin:cloth:500", "--bvh", "--json", "a.json"}};
    for (std::size_t i = 0; i < commands.size(); ++i) {
        for (int allocation = static_cast<int>(i) * 100; allocation < 12'000; allocation += 401) {
            SCOPED_TRACE(commands[i].front() + ' ' + std::to_string(allocation));
            expect_limit(run_without(allocation, commands[i], TemporaryFolder()));
        }
    }
}

TEST(Faults, AnArenaEndsWithoutMemory) {
    std::optional<ThreadArena> arena(2);
    memory_is_out = true;
    arena.reset();
    memory_is_out = false;
}

TEST(Faults, AKilledProgramLeavesNoTornFileAndTheNextRunIsWhole) {
    const auto start = std::chrono::steady_clock::now();
    const Outputs complete = outputs_of_a_run();
    const auto length = std::chrono::steady_clock::now() - start;
    for (int part = 1; part < 10; ++part) {
        const TemporaryFolder folder;
        Started started(kWork, {.folder = folder.path()});
        std::this_thread::sleep_for(length * part / 10);
        started.send(SIGKILL);
        started.wait();
        EXPECT_EQ(run(kWork, {.folder = folder.path()}).code, 0);
        EXPECT_EQ(outputs_of(folder), complete);
    }
}

}  // namespace
}  // namespace mray::test
