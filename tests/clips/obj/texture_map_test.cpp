#include "clips/obj/texture_map.h"

#include <gtest/gtest.h>

namespace mray {
namespace {

TEST(TextureMapStatement, NamesAFileThatMayHaveBlanksQuotesAndBackslashes) {
    EXPECT_EQ(parse_texture_map("a.png").map.file, "a.png");
    EXPECT_EQ(parse_texture_map("  a b.png\t").map.file, "a b.png");
    EXPECT_EQ(parse_texture_map("\"a b.png\"").map.file, "a b.png");
    EXPECT_EQ(parse_texture_map("C:\\x\\a.png").map.file, "C:/x/a.png");
    EXPECT_EQ(parse_texture_map("-odd.png").map.file, "-odd.png");
}

TEST(TextureMapStatement, ScalesOffsetsAndClampsAreRead) {
    const ParsedMap parsed = parse_texture_map("-s 2 3 1 -o 0.5 -clamp on -blendu on a b.png");
    EXPECT_EQ(parsed.problem, "");
    EXPECT_EQ(parsed.ignored, "");
    EXPECT_EQ(parsed.map.file, "a b.png");
    EXPECT_EQ(parsed.map.scale, (std::array<float, 2>{2, 3}));
    EXPECT_EQ(parsed.map.offset, (std::array<float, 2>{0.5f, 0}));
    EXPECT_TRUE(parsed.map.clamp);
    EXPECT_FALSE(parse_texture_map("-clamp off a.png").map.clamp);
    // A file whose name is a number.
    const ParsedMap number = parse_texture_map("-s 2 3 4");
    EXPECT_EQ(number.map.file, "4");
    EXPECT_EQ(number.map.scale, (std::array<float, 2>{2, 3}));
}

TEST(TextureMapStatement, OptionsThatWouldChangeTheImageAreNamed) {
    EXPECT_EQ(parse_texture_map("-mm 0 2 a.png").ignored, "-mm");
    EXPECT_EQ(parse_texture_map("-mm 0 1 a.png").ignored, "");
    EXPECT_EQ(parse_texture_map("-t 1 1 1 -cc on a.png").ignored, "-t");
    EXPECT_EQ(parse_texture_map("-t 0 0 0 -cc off a.png").ignored, "");
    EXPECT_EQ(parse_texture_map("-imfchan l a.png").ignored, "-imfchan");
}

TEST(TextureMapStatement, ValuesThatAreNotThereAreProblems) {
    for (const char* text : {"", "-s", "-s x a.png", "-o inf a.png", "-s 1 2 3", "-clamp a.png",
                             "-clamp maybe a.png", "-mm 1 a.png", "-clamp on"}) {
        const ParsedMap parsed = parse_texture_map(text);
        if (std::string(text) == "-s 1 2 3") {
            EXPECT_EQ(parsed.map.file, "3");
            continue;
        }
        EXPECT_NE(parsed.problem, "") << text;
    }
}

}  // namespace
}  // namespace mray
