// Files that are read and written.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "common/base/input_file.h"
#include "common/base/output_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;
namespace fs = std::filesystem;

/// Expects bad input with a message that contains `about`.
void expect_refused(const fs::path& path, const std::string& about) {
    const std::optional<Error> error = error_of([&] { read_input_file(path); });
    ASSERT_TRUE(error) << path;
    EXPECT_EQ(error->kind(), ErrorKind::kBadInput) << path;
    EXPECT_TRUE(has(error->what(), about));
}

TEST(InputFile, WhatIsNoFileIsRefusedAtOnce) {
    const TemporaryFolder folder;
    expect_refused(folder.path() / "none.obj", "none.obj: no such file; ");
    expect_refused(folder.write("a", "") / "b", "");
    expect_refused(std::string(5000, 'a'), "");
    expect_refused("", "");
    expect_refused(folder.path(), "is a folder");
    const fs::path pipe = folder.path() / "pipe.obj";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0644), 0);
    const fs::path socket_path = folder.path() / "s";
    const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    sockaddr_un address = {};
    address.sun_family = AF_UNIX;
    socket_path.native().copy(address.sun_path, sizeof(address.sun_path) - 1);
    ASSERT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    for (const fs::path& path :
         {pipe, socket_path, fs::path("/dev/zero"), fs::path("/dev/random"), fs::path("/dev/null")})
        expect_refused(path, "pipe or device");
    close(fd);
}

TEST(InputFile, FileWithoutReadPermissionIsBadInput) {
    const TemporaryFolder folder;
    const fs::path path = folder.write("secret.obj", "v 0 0 0\n");
    chmod(path.c_str(), 0);
    // Root may read everything.
    const uid_t user = geteuid();
    constexpr uid_t kNobody = 65534;
    ASSERT_EQ(seteuid(user == 0 ? kNobody : user), 0);
    expect_refused(path, "may not be read");
    ASSERT_EQ(seteuid(user), 0);
}

TEST(InputFile, LimitIsOfBytesAndInclusive) {
    const TemporaryFolder folder;
    const std::string bytes("\0b\r\n\xFF", 5);
    const fs::path path = folder.write("a", bytes);
    EXPECT_EQ(read_input_file(path, 5), bytes);
    EXPECT_EQ(kind_of([&] { read_input_file(path, 4); }), ErrorKind::kLimit);
}

TEST(SideFile, IsFoundBesideTheSceneAndBelowIt) {
    const TemporaryFolder folder;
    const fs::path scene = folder.write("scene.obj", "");
    const fs::path mtl = folder.write("a.mtl", "");
    const fs::path below = folder.write("materials/b.mtl", "");
    EXPECT_EQ(side_file(scene, "a.mtl"), fs::canonical(mtl));
    EXPECT_EQ(side_file(scene, "./materials/b.mtl"), fs::canonical(below));
}

TEST(SideFile, NeverLeavesTheFolderOfTheScene) {
    const TemporaryFolder folder;
    const fs::path scene = folder.write("inside/scene.obj", "");
    const fs::path outside = folder.write("outside.mtl", "");
    folder.write("inside_too/c.mtl", "");
    fs::create_symlink(outside, folder.path() / "inside/link.mtl");
    fs::create_directory_symlink(folder.path(), folder.path() / "inside/up");
    for (const std::string& name :
         {std::string("../outside.mtl"), std::string("../../../../../../etc/passwd"),
          std::string("/etc/passwd"), outside.native(), std::string("link.mtl"),
          std::string("up/outside.mtl"), std::string("up/inside_too/c.mtl"),
          std::string("../inside/none.mtl"), std::string("none.mtl"), std::string("a\0b", 3)}) {
        EXPECT_EQ(kind_of([&] { side_file(scene, name); }), ErrorKind::kBadInput) << name;
    }
}

/// An empty folder of its own for each test.
class OutputFile : public ::testing::Test {
protected:
    const TemporaryFolder temporary_;
    const fs::path folder_ = temporary_.path();
    const fs::path file_ = folder_ / "file";
};

template <class Call>
void expect_output_error(const Call& call) {
    EXPECT_EQ(kind_of(call), ErrorKind::kOutput);
}

mode_t mode_of(const fs::path& path) {
    struct stat status = {};
    ::stat(path.c_str(), &status);
    return status.st_mode & 07777;
}

TEST_F(OutputFile, HoldsExactlyTheBytesAndLeavesNoOtherFile) {
    const std::string bytes("a\0b\r\n\xff", 6);
    write_file(file_, bytes);
    EXPECT_EQ(read_file(file_), bytes);
    EXPECT_EQ(temporary_.names(), std::vector<std::string>{"file"});
}

TEST_F(OutputFile, HasTheModeOfTheUmaskOrOfTheFileThatItReplaces) {
    const mode_t before = ::umask(027);
    write_file(file_, "old");
    ::umask(before);
    EXPECT_EQ(mode_of(file_), 0640u);
    ::chmod(file_.c_str(), 0604);
    write_file(file_, "new");
    EXPECT_EQ(mode_of(file_), 0604u);
}

TEST_F(OutputFile, ReportsAClosedPipe) {
    std::array<int, 2> ends = {};
    ASSERT_EQ(::pipe(ends.data()), 0);
    ::close(ends[0]);
    const auto before = ::signal(SIGPIPE, SIG_IGN);
    expect_output_error([&] { write_file("/dev/fd/" + std::to_string(ends[1]), "text"); });
    ::signal(SIGPIPE, before);
    ::close(ends[1]);
}

TEST_F(OutputFile, GoesThroughADescriptorThatWasRedirectedToAFile) {
    const fs::path path = folder_ / "redirected";
    const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT, 0600);
    ASSERT_EQ(::write(fd, "head ", 5), 5);
    write_file("/dev/fd/" + std::to_string(fd), "body ");
    ASSERT_EQ(::write(fd, "tail", 4), 4);
    ::close(fd);
    EXPECT_EQ(read_file(path), "head body tail");
}

TEST_F(OutputFile, WritesThroughALinkToItsTarget) {
    write_file(folder_ / "target", "old");
    fs::create_symlink("target", folder_ / "link");
    write_file(folder_ / "link", "new");
    EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
    EXPECT_EQ(read_file(folder_ / "target"), "new");
}

TEST_F(OutputFile, RefusesPathsThatCannotBeWritten) {
    write_file(file_, "text");
    fs::create_directory(folder_ / "folder");
    fs::create_symlink("loop", folder_ / "loop");
    const std::vector<fs::path> no_folders = {
        "", file_, file_ / "child", "/proc/morphray", "/proc", folder_ / std::string(256, 'n')};
    for (const fs::path& path : no_folders) {
        SCOPED_TRACE(path);
        expect_output_error([&] { make_output_folder(path); });
    }
    std::vector<fs::path> no_files = {"", folder_, "/proc/morphray"};
    for (const std::string& name :
         {std::string("folder"), std::string("folder/"), std::string("missing/file"),
          std::string("missing/"), std::string("file/child"), std::string("loop"),
          std::string(256, 'n'), std::string(5000, 'n')})
        no_files.push_back(folder_ / name);
    for (const fs::path& path : no_files) {
        SCOPED_TRACE(path);
        expect_output_error([&] { check_writable(path); });
        expect_output_error([&] { write_file(path, "text"); });
    }
    EXPECT_EQ(read_file(file_), "text");
    EXPECT_EQ(temporary_.names().size(), 3u);
}

TEST_F(OutputFile, KilledAtAnyMomentIsTheOldOrTheNewFile) {
    const std::string texts[] = {std::string(3'000'000, 'a'), std::string(2'000'000, 'b')};
    write_file(file_, texts[0]);
    for (int round = 0; round < 40; ++round) {
        const pid_t child = ::fork();
        ASSERT_GE(child, 0);
        if (child == 0) {
            for (std::size_t i = 0;; ++i) write_file(file_, texts[i % 2]);
        }
        ::usleep(static_cast<useconds_t>(500 + 700 * round));
        ::kill(child, SIGKILL);
        ASSERT_EQ(::waitpid(child, nullptr, 0), child);
        const std::string found = read_file(file_);
        ASSERT_TRUE(found == texts[0] || found == texts[1]) << found.size() << " bytes";
    }
}

TEST_F(OutputFile, CheckingLeavesNoFile) {
    check_writable(file_);
    check_writable("/dev/null");
    EXPECT_TRUE(temporary_.names().empty());
}

TEST_F(OutputFile, FolderIsMadeWithItsParents) {
    make_output_folder(folder_ / "a" / "b" / "c");
    make_output_folder(folder_ / "a" / "b" / "c");
    EXPECT_TRUE(fs::is_empty(folder_ / "a" / "b" / "c"));
}

}  // namespace
}  // namespace mray
