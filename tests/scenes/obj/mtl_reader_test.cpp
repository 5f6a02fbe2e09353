#include <gtest/gtest.h>

#include "scenes/obj/obj_materials.h"

namespace mray {
namespace {

MaterialMap read(const std::string& text) {
    MaterialMap materials;
    read_mtl_text(text, "a.mtl", materials);
    return materials;
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
TEST(MtlReader, NumbersThatAreNoneAreZero) {
    for (const char* kd : {"Kd nan 0 1", "Kd inf 0 1", "Kd a 0 1"})
        EXPECT_EQ(material_of(kd).albedo, 0xFF0000u) << kd;
    EXPECT_EQ(material_of("map_Kd -o 1 inf 1 a.png").offset, (std::array<float, 2>{1, 0}));
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
}
}  // namespace
}  // namespace mray
