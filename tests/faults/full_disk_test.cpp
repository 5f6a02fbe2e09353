// A disk that fills up: the program says so, and no file is torn.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>

#include "tests/faults/whole_files.h"

namespace mray::test {
namespace {

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

/// A plot needs a temporary file, which does not fit on a disk of one page.
void expect_no_scratch_file(const TemporaryFolder& place) {
    ASSERT_EQ(::mount("tmpfs", place.path().c_str(), "tmpfs", 0, "size=4096"), 0);
    const TemporaryFolder folder;
    const Outcome outcome =
        run({"profile", "builtin:cloth:200", "--backend", "cpu", "--size", "8x8", "--repeat", "1",
             "--policies", "refit,rebuild", "--plot", folder.file("p.svg")},
            {.environment = {"TMPDIR=" + place.path().string()}});
    // Without gnuplot nothing is drawn.
    EXPECT_TRUE(outcome.code == 5 || outcome.code == 4) << outcome.err;
    EXPECT_TRUE(place.names().empty()) << place.names().front();
    ::umount2(place.path().c_str(), MNT_DETACH);
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
            EXPECT_NE(outcome.err.find("No space left on device"), std::string::npos)
                << outcome.err;
        } else {
            EXPECT_EQ(outputs_of(place).size(), complete.size());
        }
        expect_whole(outputs_of(place), complete);
    }
    expect_no_scratch_file(place);
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
