#include <fmt/format.h>
#include <gtest/gtest.h>

#include "scenes/sequence/streamed_animation.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;

void write_all(const TemporaryFolder& folder, std::initializer_list<const char*> names) {
    for (const char* name : names) folder.write(name, "");
}

std::vector<std::pair<double, std::string>> listed(const std::vector<KeyframeFile>& files) {
    std::vector<std::pair<double, std::string>> result;
    for (const KeyframeFile& file : files) {
        result.emplace_back(file.frame, file.path.filename().native());
    }
    return result;
}

using Listed = std::vector<std::pair<double, std::string>>;

TEST(KeyframeFilesOfFolder, AreInTheOrderOfTheirNumbersAndTheLeastStepIsOneFrame) {
    const struct {
        std::vector<const char*> names;
        Listed expected;
    } cases[] = {{{"f10.obj", "f9.obj", "f8.obj", "f11.obj", "readme.txt", "f.mtl", ".f7.obj"},
                  {{0, "f8.obj"}, {1, "f9.obj"}, {2, "f10.obj"}, {3, "f11.obj"}}},
                 {{"a_0100.obj", "a_0110.obj", "a_0120.obj"},
                  {{0, "a_0100.obj"}, {1, "a_0110.obj"}, {2, "a_0120.obj"}}},
                 {{"mesh.obj"}, {{0, "mesh.obj"}}}};
    for (const auto& [names, expected] : cases) {
        const TemporaryFolder folder;
        for (const char* name : names) folder.write(name, "");
        folder.write("f12.obj/file", "");
        EXPECT_EQ(listed(files_of_folder(folder.path(), {})), expected);
    }
}

TEST(KeyframeFilesOfFolder, WithoutObjFilesIsBadInput) {
    const TemporaryFolder folder;
    EXPECT_EQ(kind_of([&] { files_of_folder(folder.path(), {}); }), ErrorKind::kBadInput);
    write_all(folder, {"a.txt", ".obj"});
    EXPECT_EQ(kind_of([&] { files_of_folder(folder.path(), {}); }), ErrorKind::kBadInput);
    EXPECT_EQ(kind_of([&] { files_of_folder(folder.path() / "none", {}); }), ErrorKind::kBadInput);
}

TEST(KeyframeFilesOfFolder, NamesThatDifferAreRefused) {
    for (const auto& names : {std::vector<const char*>{"a_1.obj", "b_2.obj"},
                              {"a_1.obj", "a_2_low.obj"},
                              {"a.obj", "b.obj"},
                              {"a.obj", "a1.obj"},
                              {"a_01.obj", "a_1.obj"},
                              {"a_1.obj", "a_2.ply"},
                              {"a_1.obj", "a_1234567890123456789.obj"}}) {
        const TemporaryFolder folder;
        for (const char* name : names) folder.write(name, "");
        const auto error = error_of([&] { files_of_folder(folder.path(), {}); });
        ASSERT_TRUE(error) << names[0];
        EXPECT_EQ(error->kind(), ErrorKind::kBadInput);
        EXPECT_NE(std::string(error->what()).find(names[1]), std::string::npos) << error->what();
    }
}

TEST(KeyframeFilesOfFolder, MissingFrameIsRefusedByNameUnlessAskedFor) {
    const TemporaryFolder folder;
    for (int i = 1; i <= 12; ++i) {
        if (i != 7) folder.write(fmt::format("f_{:02}.obj", i), "");
    }
    const std::string message = message_of([&] { files_of_folder(folder.path(), {}); });
    EXPECT_NE(message.find("f_07.obj: frame is missing; "), std::string::npos) << message;
    std::vector<std::string> warnings;
    const AnimationOptions options = {.skip_missing = true, .warn = [&](const Warning& warning) {
                                          warnings.push_back(warning.line());
                                      }};
    const Listed files = listed(files_of_folder(folder.path(), options));
    EXPECT_EQ(files.size(), 11u);
    EXPECT_EQ(files[6], (std::pair<double, std::string>{7, "f_08.obj"}));
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("f_07.obj: warning: frame is missing; "), std::string::npos);
}

TEST(KeyframeFilesOfPattern, KeepTheNumbersOfTheirNames) {
    const TemporaryFolder folder;
    write_all(folder, {"f_009.obj", "f_010.obj", "f_011.obj", "g_001.obj", "f_x.obj", "f_.obj"});
    EXPECT_EQ(listed(files_of_pattern((folder.path() / "f_%03d.obj").native(), {})),
              (Listed{{9, "f_009.obj"}, {10, "f_010.obj"}, {11, "f_011.obj"}}));
    EXPECT_EQ(listed(files_of_pattern((folder.path() / "g_*.obj").native(), {})),
              (Listed{{1, "g_001.obj"}}));
}

TEST(KeyframeFilesOfPattern, AStarThatIsNoNumberStandsForTheFilesOfAFolder) {
    const TemporaryFolder folder;
    write_all(folder, {"f_2.obj", "f_3.obj", "f.mtl"});
    for (const char* pattern : {"*.obj", "f*.obj"})
        EXPECT_EQ(listed(files_of_pattern((folder.path() / pattern).native(), {})),
                  (Listed{{0, "f_2.obj"}, {1, "f_3.obj"}}));
    write_all(folder, {"g_3.obj"});
    const std::string message =
        message_of([&] { files_of_pattern((folder.path() / "*.obj").native(), {}); });
    EXPECT_NE(message.find("f_2.obj and g_3.obj are not frames of one sequence"), std::string::npos)
        << message;
}

TEST(KeyframeFilesOfPattern, MissingFrameIsRefusedByNameUnlessAskedFor) {
    const TemporaryFolder folder;
    write_all(folder, {"f_5.obj", "f_6.obj", "f_9.obj", "f_11.obj"});
    const std::string pattern = (folder.path() / "f_%d.obj").native();
    const std::string message = message_of([&] { files_of_pattern(pattern, {}); });
    EXPECT_NE(message.find("f_7.obj: frame is missing and 2 more; "), std::string::npos) << message;
    EXPECT_EQ(listed(files_of_pattern(pattern, {.skip_missing = true})),
              (Listed{{5, "f_5.obj"}, {6, "f_6.obj"}, {9, "f_9.obj"}, {11, "f_11.obj"}}));
}

TEST(KeyframeFilesOfPattern, WithoutFilesAreBadInput) {
    const TemporaryFolder folder;
    EXPECT_EQ(kind_of([&] { files_of_pattern((folder.path() / "f_%d.obj").native(), {}); }),
              ErrorKind::kBadInput);
    EXPECT_EQ(kind_of([&] { files_of_pattern((folder.path() / "none/f_%d.obj").native(), {}); }),
              ErrorKind::kBadInput);
    EXPECT_EQ(kind_of([&] { files_of_pattern((folder.path() / "f_%s.obj").native(), {}); }),
              ErrorKind::kBadArgument);
}

}  // namespace
}  // namespace mray
