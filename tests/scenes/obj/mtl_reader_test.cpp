#include <fmt/format.h>
#include <gtest/gtest.h>

#include "scenes/obj/obj_reader.h"

namespace mray {
namespace {

MaterialMap read(const std::string& text) {
    WarningCount unread;
    return read_mtl_text(text, "a.mtl", unread);
}
std::string warning_of(const std::string& text) {
    WarningCount unread;
    read_mtl_text(text, "a.mtl", unread);
    std::string line;
    unread.tell([&](const Warning& warning) { line = warning.line(); });
    return line;
}
Material material_of(const std::string& statement) {
    return read("newmtl a\n" + statement + "\nnewmtl b\nKd 1 1 1\n").at("a");
}

TEST(MtlReader, ReadsLinearColoursOfEightBits) {
    const auto materials = read("newmtl a\nKa 1 1 1\nKd 0 0.5 1\nmap_Kd x.png\n");
    ASSERT_EQ(materials.size(), 1u);
    EXPECT_EQ(materials.at("a").albedo, 0xFF8000u);
}
TEST(MtlReader, MaterialWithoutColourIsTheDefault) {
    EXPECT_FALSE(read("Kd 1 0 0\nnewmtl a\nNs 5\n").at("a").albedo);
    EXPECT_EQ(material_of("Kd 0 0 0").albedo, 0u);
}
TEST(MtlReader, OneNumberIsGrey) {
    EXPECT_EQ(material_of("Kd 1").albedo, 0xFFFFFFu);
    EXPECT_EQ(material_of("Kd 0.5 # half").albedo, 0x808080u);
    EXPECT_EQ(warning_of("newmtl a\nKd 1\n"), "");
}
TEST(MtlReader, ColoursThatAreNotReadAreWarnings) {
    for (const char* kd : {"Kd a 0 1", "Kd 1 x", "Kd 1 0", "Kd spectral x.rfl 1", "Kd xyz 0 1 0"}) {
        EXPECT_FALSE(material_of(kd).albedo) << kd;
        EXPECT_EQ(warning_of(fmt::format("newmtl a\n{}\n", kd)),
                  fmt::format("a.mtl:2: warning: '{}' is not read; write one number or three", kd));
    }
    EXPECT_EQ(material_of("Kd nan 0 2").albedo, 0xFF0000u);
    EXPECT_EQ(warning_of("newmtl a\nKd nan 0 2\n"),
              "a.mtl:2: warning: colour nan is not from 0 to 1; clamped (and 1 more)");
}
TEST(MtlReader, TheFirstMaterialOfANameStays) {
    const auto materials = read("newmtl a\nKd 1 0 0\nnewmtl a\nKd 0 1 0\n");
    EXPECT_EQ(materials.at("a").albedo, 0x0000FFu);
}
TEST(MtlReader, TexturesKeepTheirFileAndLibrary) {
    const Material a = material_of("map_Kd -clamp on x y.png");
    EXPECT_EQ(a.map, "x y.png");
    EXPECT_EQ(a.library, "a.mtl");
    EXPECT_FALSE(a.albedo);
    EXPECT_EQ(material_of("map_Kd").map, "");
}
TEST(MtlReader, NamesOfTexturesMayHaveBlanksQuotesAndBackslashes) {
    EXPECT_EQ(material_of("map_Kd   a b.png\t").map, "a b.png");
    EXPECT_EQ(material_of("map_Kd \"a b.png\"").map, "a b.png");
    EXPECT_EQ(material_of("map_Kd C:\\x\\a.png").map, "C:/x/a.png");
}
TEST(MtlReader, ScalesOffsetsAndClampsOfTexturesAreReadAndOtherOptionsPassed) {
    const Material a = material_of("map_Kd -s 2 3 1 -mm 0 1 -o 0.5 0 0 -clamp on a b.png");
    EXPECT_EQ(a.map, "a b.png");
    EXPECT_EQ(a.scale, (std::array<float, 2>{2, 3}));
    EXPECT_EQ(a.offset, (std::array<float, 2>{0.5f, 0}));
    EXPECT_TRUE(a.clamp);
    EXPECT_FALSE(material_of("map_Kd -clamp off a.png").clamp);
    EXPECT_EQ(material_of("map_Kd -o 1 inf 1 a.png").offset, (std::array<float, 2>{1, 0}));
}
TEST(MtlReader, NumbersAreTheNearestFloats) {
    const Material a =
        material_of("map_Kd -s 0.1 -1.17549435e-38 -o 16777217 3.4028235e38 1 a.png");
    EXPECT_EQ(a.scale, (std::array<float, 2>{0.1f, -1.17549435e-38f}));
    EXPECT_EQ(a.offset, (std::array<float, 2>{16777216.0f, 3.4028235e38f}));
    // tinyobjloader takes 1 of 1x, and all of what begins with "on".
    const Material b = material_of("map_Kd -s 3x 1 2 -clamp once a.png");
    EXPECT_EQ(b.scale, (std::array<float, 2>{1, 1}));
    EXPECT_FALSE(b.clamp);
}
TEST(MtlReader, NamesMayHaveBlanksAndMustNotBeEmpty) {
    const MaterialMap materials = read("newmtl  a  b \nKd 1\nnewmtl\nKd 0\nmap_Kd x.png\n");
    ASSERT_EQ(materials.size(), 1u);
    EXPECT_EQ(materials.at("a  b").albedo, 0xFFFFFFu);
    EXPECT_EQ(materials.at("a  b").map, "");
}
TEST(MtlReader, OptionsMayHaveFewerNumbers) {
    for (const char* map :
         {"map_Kd -s 2 a b.png", "map_Kd -s 2 1 a b.png", "map_Kd -mm 0 -s 2 1 1 -o 0 a b.png",
          "map_Kd -blendu on -blendv off -cc on -texres 4 -s 2 a b.png",
          "map_Kd -colorspace sRGB -s 2 a b.png",
          "map_Kd -bm 1 -imfchan r -boost 2 -type sphere -t 0 -s 2 a b.png"}) {
        EXPECT_EQ(material_of(map).map, "a b.png") << map;
        EXPECT_EQ(material_of(map).scale, (std::array<float, 2>{2, 1})) << map;
    }
    // A file may have a number as its name.
    EXPECT_EQ(material_of("map_Kd -o 0.5 2").map, "2");
    EXPECT_EQ(material_of("map_Kd -o").map, "");
}
}  // namespace
}  // namespace mray
