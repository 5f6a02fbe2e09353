// What goes wrong around the program: allocations fail, it is killed while it writes, and disks
// fill up. Files that are there are whole.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <map>
#include <new>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/base/thread_arena.h"
#include "tests/app/program.h"

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

const Words kWork = words(
    "render builtin:cloth:500 --backend cpu --frames 0..3 --threads 2 --size 32x32 --out out "
    "--hits hits --quiet");

/// Bytes of files by their names, without what a killed process was writing.
using Outputs = std::map<std::string, std::string>;

Outputs outputs_of(const TemporaryFolder& folder) {
    Outputs files;
    for (const std::string& name : folder.names()) {
        const std::filesystem::path path = folder.path() / name;
        if (std::filesystem::is_regular_file(path) && !name.ends_with(".partial"))
            files[name] = read_file(path);
    }
    return files;
}

Outputs outputs_of_a_run() {
    const TemporaryFolder folder;
    const Outcome outcome = run(kWork, {.folder = folder.path()});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outputs_of(folder);
}

/// Expects each file to be that of the complete run.
void expect_whole(const Outputs& outputs, const Outputs& complete) {
    for (const auto& [name, bytes] : outputs) {
        const auto known = complete.find(name);
        ASSERT_NE(known, complete.end()) << "an unexpected file: " << name;
        EXPECT_EQ(bytes, known->second) << name;
    }
}

Outcome run_without(int allocation, const Words& command, const TemporaryFolder& folder) {
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
    const Words commands = {
        "crosscheck builtin:cloth:200 --frames 0..1 --size 8x8 --backend cpu --queries 9 "
        "--json a.json --junit a.xml --html a.html -q",
        "profile builtin:cloth:500 --frames 0..1 --size 8x8 --backend cpu --repeat 1 "
        "--json a.json -q",
        "trace builtin:cloth:500 --rays - --out a.txt --all",
        "info builtin:cloth:500 --bvh --json a.json"};
    for (std::size_t i = 0; i < commands.size(); ++i) {
        for (int allocation = static_cast<int>(i) * 100; allocation < 12'000; allocation += 401) {
            SCOPED_TRACE(commands[i] + ' ' + std::to_string(allocation));
            expect_limit(run_without(allocation, words(commands[i]), TemporaryFolder()));
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

void write_to(const char* file, const std::string& text) {
    const int fd = ::open(file, O_WRONLY | O_CLOEXEC);
    static_cast<void>(::write(fd, text.data(), text.size()));
    ::close(fd);
}

/// Gives this process a view of the file system of its own, in which it may mount.
bool may_mount() {
    const std::string user = "0 " + std::to_string(::getuid()) + " 1";
    const std::string group = "0 " + std::to_string(::getgid()) + " 1";
    if (::unshare(CLONE_NEWUSER | CLONE_NEWNS) == 0) {
        write_to("/proc/self/setgroups", "deny");
        write_to("/proc/self/uid_map", user);
        write_to("/proc/self/gid_map", group);
    } else if (::unshare(CLONE_NEWNS) != 0) {
        return false;
    }
    return ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
}

/// Runs the program on disks of one page, two, ..., until it has room. Returns false where this
/// process may not mount.
bool try_disks() {
    const Outputs complete = outputs_of_a_run();
    const TemporaryFolder place;
    if (!may_mount()) return false;
    constexpr int kPage = 4096;
    for (int pages = 1, code = -1; code != 0 && pages < 100; ++pages) {
        SCOPED_TRACE(std::to_string(pages) + " pages");
        const std::string size = "size=" + std::to_string(pages * kPage);
        if (::mount("tmpfs", place.path().c_str(), "tmpfs", 0, size.c_str()) != 0) return false;
        struct Unmount {
            const char* path;
            ~Unmount() { ::umount2(path, MNT_DETACH); }
        } const unmount{place.path().c_str()};
        const Outcome outcome = run(kWork, {.folder = place.path()});
        code = outcome.code;
        EXPECT_TRUE(code == 0 || code == 5) << code << ": " << outcome.err;
        if (code != 0) {
            EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
            EXPECT_TRUE(has(outcome.err, "No space left on device"));
        } else {
            EXPECT_EQ(outputs_of(place).size(), complete.size());
        }
        expect_whole(outputs_of(place), complete);
    }
    return true;
}

TEST(FullDisk, LeavesNoTornFile) {
    // In a process of its own, which ends with its mounts.
    const ::pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        const bool mounted = try_disks();
        ::_exit(!mounted ? 2 : HasFailure() ? 1 : 0);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status));
    if (WEXITSTATUS(status) == 2) GTEST_SKIP() << "this system lets no test mount a disk";
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace mray::test
