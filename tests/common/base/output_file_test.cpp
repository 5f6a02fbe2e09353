#include "common/base/output_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;
namespace fs = std::filesystem;

/// An empty folder of its own for each test.
class OutputFile : public ::testing::Test {
protected:
    std::vector<std::string> names() const { return temporary_.names(); }

    const TemporaryFolder temporary_;
    const fs::path folder_ = temporary_.path();
};

/// The message of the Error(kOutput) that `call` throws; fails the test when it throws nothing
/// else.
template <class Call>
std::string output_error(const Call& call) {
    const std::optional<Error> error = error_of(call);
    if (!error) {
        ADD_FAILURE() << "nothing was thrown";
        return {};
    }
    EXPECT_EQ(error->kind(), ErrorKind::kOutput) << error->what();
    return error->what();
}

TEST_F(OutputFile, HoldsExactlyTheBytesAndLeavesNoOtherFile) {
    const std::string bytes("a\0b\r\n\xff", 6);
    write_file(folder_ / "new", bytes);
    EXPECT_EQ(read_file(folder_ / "new"), bytes);
    EXPECT_EQ(names(), std::vector<std::string>{"new"});
}

TEST_F(OutputFile, KeepsTheModeOfTheFileThatItReplaces) {
    write_file(folder_ / "file", "old");
    ::chmod((folder_ / "file").c_str(), 0640);
    write_file(folder_ / "file", "new");
    struct stat status = {};
    ::stat((folder_ / "file").c_str(), &status);
    EXPECT_EQ(status.st_mode & 07777, 0640u);
}

TEST_F(OutputFile, HonoursTheUmaskForANewFile) {
    const mode_t before = ::umask(027);
    write_file(folder_ / "file", "new");
    ::umask(before);
    struct stat status = {};
    ::stat((folder_ / "file").c_str(), &status);
    EXPECT_EQ(status.st_mode & 07777, 0640u);
}

TEST_F(OutputFile, ReportsAFullDevice) {
    const std::string message = output_error([] { write_file("/dev/full", "text"); });
    EXPECT_NE(message.find("/dev/full"), std::string::npos) << message;
    EXPECT_NE(message.find("No space left"), std::string::npos) << message;
}

TEST_F(OutputFile, ReportsAClosedPipe) {
    std::array<int, 2> ends = {};
    ASSERT_EQ(::pipe(ends.data()), 0);
    ::close(ends[0]);
    const auto before = ::signal(SIGPIPE, SIG_IGN);
    output_error([&] { write_file("/dev/fd/" + std::to_string(ends[1]), "text"); });
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

/// Paths that cannot be written are refused by check_writable and by write_file.
TEST_F(OutputFile, RefusesPathsThatCannotBeWritten) {
    write_file(folder_ / "file", "text");
    fs::create_directory(folder_ / "folder");
    fs::create_symlink("loop", folder_ / "loop");
    const std::vector<fs::path> refused = {
        "",
        folder_,
        folder_ / "folder",
        folder_ / "folder" / "",
        folder_ / "missing" / "file",
        folder_ / "missing" / "",
        folder_ / "file" / "child",
        folder_ / "loop",
        folder_ / std::string(256, 'n'),
        folder_ / std::string(5000, 'n'),
        "/proc/morphray",
    };
    for (const fs::path& path : refused) {
        SCOPED_TRACE(path);
        output_error([&] { check_writable(path); });
        output_error([&] { write_file(path, "text"); });
    }
    EXPECT_EQ(read_file(folder_ / "file"), "text");
    EXPECT_EQ(names().size(), 3u);
}

TEST_F(OutputFile, CheckingLeavesNoFile) {
    check_writable(folder_ / "file");
    check_writable("/dev/null");
    EXPECT_TRUE(names().empty());
}

TEST_F(OutputFile, KilledAtAnyMomentIsTheOldOrTheNewFile) {
    const std::array<std::string, 2> texts = {std::string(3'000'000, 'a'),
                                              std::string(2'000'000, 'b')};
    const fs::path path = folder_ / "file";
    write_file(path, texts[0]);
    for (int round = 0; round < 40; ++round) {
        const pid_t child = ::fork();
        ASSERT_GE(child, 0);
        if (child == 0) {
            for (std::size_t i = 0;; ++i) write_file(path, texts[i % 2]);
        }
        ::usleep(static_cast<useconds_t>(500 + 700 * round));
        ::kill(child, SIGKILL);
        ASSERT_EQ(::waitpid(child, nullptr, 0), child);
        const std::string found = read_file(path);
        ASSERT_TRUE(found == texts[0] || found == texts[1]) << found.size() << " bytes";
    }
}

TEST_F(OutputFile, FolderIsMadeWithItsParents) {
    make_output_folder(folder_ / "a" / "b" / "c");
    make_output_folder(folder_ / "a" / "b" / "c");
    EXPECT_TRUE(fs::is_directory(folder_ / "a" / "b" / "c"));
    EXPECT_TRUE(fs::is_empty(folder_ / "a" / "b" / "c"));
}

TEST_F(OutputFile, FolderThatCannotBeCreatedIsRefused) {
    write_file(folder_ / "file", "text");
    const std::vector<fs::path> refused = {"",
                                           folder_ / "file",
                                           folder_ / "file" / "child",
                                           folder_ / std::string(256, 'n'),
                                           "/proc/morphray",
                                           "/proc"};
    for (const fs::path& path : refused) {
        SCOPED_TRACE(path);
        output_error([&] { make_output_folder(path); });
    }
}

}  // namespace
}  // namespace mray
