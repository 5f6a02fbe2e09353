#include "common/base/input_file.h"

#include <gtest/gtest.h>

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <optional>
#include <string>

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
    EXPECT_NE(std::string(error->what()).find(about), std::string::npos) << error->what();
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

}  // namespace
}  // namespace mray
