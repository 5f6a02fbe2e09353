#include "scenes/animation.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "scenes/mesh/mesh_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;
namespace fs = std::filesystem;

const std::string kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

std::optional<ErrorKind> code_of_opening(const std::string& spec) {
    return kind_of([&] { open_scene(spec); });
}

TEST(OpenScene, OpensAFile) {
    const TemporaryFolder folder;
    const std::string path = folder.write("a.obj", kTriangle).native();
    const auto animation = open_scene(path);
    EXPECT_EQ(animation->name(), path);
    EXPECT_EQ(animation->topology().vertex_count, 3u);
    EXPECT_EQ(animation->topology().triangles, std::vector<uvec3>{uvec3(0, 1, 2)});
    EXPECT_EQ(animation->topology().albedo, std::vector<Albedo>{kClay});
    EXPECT_EQ(animation->first_frame(), 0);
    EXPECT_EQ(animation->last_frame(), 0);
}

TEST(OpenScene, OpensAPatternWithAStar) {
    const TemporaryFolder folder;
    for (const char* name :
         {"f_8.obj", "f_9.obj", "f_10.obj", "f_x.obj", "f_11.obj.bak", "g_1.obj"})
        folder.write(name, kTriangle);
    const auto animation = open_scene((folder.path() / "f_*.obj").native());
    EXPECT_EQ(animation->first_frame(), 8);
    EXPECT_EQ(animation->last_frame(), 10);
    folder.write("f_010.obj", kTriangle);
    EXPECT_EQ(code_of_opening((folder.path() / "f_*.obj").native()), ErrorKind::kBadInput);
    EXPECT_EQ(code_of_opening((folder.path() / "k_*.obj").native()), ErrorKind::kBadInput);
    EXPECT_EQ(code_of_opening((folder.path() / "*_*.obj").native()), ErrorKind::kBadArgument);
    EXPECT_EQ(code_of_opening((folder.path() / "*/f.obj").native()), ErrorKind::kBadArgument);
}

TEST(OpenScene, NameOfABuiltinSceneWithoutItsPrefixGivesAHint) {
    for (const char* spec : {"cloth", "twist:5000"}) {
        const auto error = error_of([&] { open_scene(spec); });
        ASSERT_TRUE(error);
        EXPECT_EQ(error->kind(), ErrorKind::kBadInput);
        EXPECT_NE(std::string(error->what()).find(fmt::format("did you mean builtin:{}?", spec)),
                  std::string::npos)
            << error->what();
    }
}

TEST(OpenScene, FileThatIsThereIsNoPattern) {
    const TemporaryFolder folder;
    EXPECT_EQ(open_scene(folder.write("100%.obj", kTriangle).native())->last_frame(), 0);
}

TEST(OpenScene, BadPatternsAreUsageErrors) {
    const TemporaryFolder folder;
    for (const char* pattern : {"%s.obj", "%n.obj", "%d%d.obj", "%99999999d.obj", "100%"}) {
        EXPECT_EQ(code_of_opening((folder.path() / pattern).native()), ErrorKind::kBadArgument)
            << pattern;
    }
}

TEST(OpenScene, WhatIsNoSceneIsBadInput) {
    const TemporaryFolder folder;
    EXPECT_EQ(code_of_opening((folder.path() / "none.obj").native()), ErrorKind::kBadInput);
    EXPECT_EQ(code_of_opening(folder.path().native()), ErrorKind::kBadInput);
    EXPECT_EQ(code_of_opening(folder.write("a.png", kTriangle).native()), ErrorKind::kBadInput);
    EXPECT_EQ(code_of_opening(folder.write("a.obj", "").native()), ErrorKind::kBadInput);
    EXPECT_EQ(code_of_opening("/dev/zero"), ErrorKind::kBadInput);
    EXPECT_EQ(code_of_opening("/dev/random"), ErrorKind::kBadInput);
    const fs::path pipe = folder.path() / "pipe.obj";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0644), 0);
    EXPECT_EQ(code_of_opening(pipe.native()), ErrorKind::kBadInput);
    fs::create_symlink("loop.obj", folder.path() / "loop.obj");
    EXPECT_EQ(code_of_opening((folder.path() / "loop.obj").native()), ErrorKind::kBadInput);
    EXPECT_EQ(code_of_opening(std::string(10'000, 'x')), ErrorKind::kBadInput);
}

TEST(OpenScene, MoreThanFourGibibytesAreOverTheLimit) {
    const TemporaryFolder folder;
    const fs::path path = folder.write("huge.obj", "");
    fs::resize_file(path, (std::uint64_t{4} << 30) + 1);
    EXPECT_EQ(code_of_opening(path.native()), ErrorKind::kLimit);
}

TEST(OpenScene, BadBuiltinSpecsAreUsageErrors) {
    for (const char* spec : {"", "builtin:", "builtin:no such scene", "builtin:x:0", "builtin:x:-1",
                             "builtin:x:1e6", "builtin:x:", "builtin:x:1:2", "builtin:x:nan"}) {
        EXPECT_EQ(code_of_opening(spec), ErrorKind::kBadArgument) << spec;
    }
}

TEST(OpenScene, BuiltinOfNoNumberOfTrianglesIsToldOneThatOpens) {
    for (const char* spec : {"builtin:herd:abc", "builtin:herd:0",
                             "builtin:herd:", "builtin:no such scene:abc", "builtin:\n:abc"}) {
        const std::string message = message_of([&] { open_scene(spec); });
        EXPECT_TRUE(message.ends_with("such as builtin:cloth:100000")) << message;
    }
    EXPECT_NO_THROW(open_scene("builtin:cloth:100000"));
}

TEST(OpenScene, NamesThatAreNotUtf8Work) {
    const TemporaryFolder folder;
    EXPECT_EQ(open_scene(folder.write("\xE4\xFF \n.obj", kTriangle).native())->last_frame(), 0);
}

}  // namespace
}  // namespace mray
