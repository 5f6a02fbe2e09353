#include "scenes/obj/obj_materials.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace mray {
namespace {

struct Library {
    MaterialMap materials;
    std::vector<std::string> warnings;
};
Library read(const std::string& text) {
    Library library;
    read_mtl_text(
        text, "a.mtl", "a.mtl", [&](const Warning& w) { library.warnings.push_back(w.line()); },
        library.materials);
    return library;
}

TEST(MtlReader, ReadsLinearColoursOfEightBits) {
    const auto materials = read("newmtl a\nKa 1 1 1\nKd 0 0.5 1\nmap_Kd x.png\n").materials;
    ASSERT_EQ(materials.size(), 1u);
    EXPECT_EQ(materials.at("a").albedo, 0xFF8000u);
}
TEST(MtlReader, MaterialWithoutColourIsTheDefault) {
    const Library library = read("Kd 1 0 0\nnewmtl a\nNs 5\n");
    EXPECT_FALSE(library.materials.at("a").albedo);
}
TEST(MtlReader, ColoursThatAreNotFiniteNumbersAreLeftOutWithTheirLine) {
    for (const char* kd : {"nan 0 0", "0 inf 0", "0 0 1e400", "a b c", "0,5 0 0", "1 2", "1 2 3 4",
                           "", "0x1 0 0", "spectral f.rfl"}) {
        const Library library = read(fmt::format("newmtl a\nKd {}\n", kd));
        EXPECT_FALSE(library.materials.at("a").albedo);
        ASSERT_EQ(library.warnings.size(), 1u);
        EXPECT_TRUE(library.warnings[0].starts_with("a.mtl:2: warning: Kd")) << kd;
    }
}
TEST(MtlReader, TexturesKeepTheirFileAndPlace) {
    const auto materials = read("newmtl a\nmap_Kd -clamp on x y.png\nnewmtl b\n").materials;
    const Material& a = materials.at("a");
    ASSERT_TRUE(a.map);
    EXPECT_EQ(a.map->file, "x y.png");
    EXPECT_EQ(a.map->place, "a.mtl:2");
    EXPECT_FALSE(a.albedo);
    EXPECT_FALSE(materials.at("b").map);
}
TextureMap map_of(const std::string& arguments) {
    return *read("newmtl a\nmap_Kd " + arguments + "\n").materials.at("a").map;
}
TEST(MtlReader, NamesOfTexturesMayHaveBlanksQuotesAndBackslashes) {
    EXPECT_EQ(map_of("  a b.png\t").file, "a b.png");
    EXPECT_EQ(map_of("\"a b.png\"").file, "a b.png");
    EXPECT_EQ(map_of("C:\\x\\a.png").file, "C:/x/a.png");
}
TEST(MtlReader, ScalesOffsetsAndClampsOfTexturesAreRead) {
    const TextureMap map = map_of("-s 2 3 1 -o 0.5 -clamp on a b.png");
    EXPECT_EQ(map.file, "a b.png");
    EXPECT_EQ(map.scale, (std::array<float, 2>{2, 3}));
    EXPECT_EQ(map.offset, (std::array<float, 2>{0.5f, 0}));
    EXPECT_TRUE(map.clamp);
    EXPECT_FALSE(map_of("-clamp off a.png").clamp);
    // A file whose name is a number.
    EXPECT_EQ(map_of("-s 2 3 4").file, "4");
    EXPECT_EQ(map_of("-s 2 3 4").scale, (std::array<float, 2>{2, 3}));
}
TEST(MtlReader, TexturesWithOtherOptionsOrWithoutTheirValuesAreLeftOut) {
    for (const char* text : {"", "-s", "-s x a.png", "-o inf a.png", "-clamp a.png",
                             "-clamp maybe a.png", "-mm 0 1 a.png", "-clamp on"}) {
        const Library library = read(std::string("newmtl a\nmap_Kd ") + text + "\n");
        EXPECT_FALSE(library.materials.at("a").map);
        ASSERT_EQ(library.warnings.size(), 1u);
        EXPECT_TRUE(library.warnings[0].starts_with("a.mtl:2: warning: map_Kd ")) << text;
    }
}
}  // namespace
}  // namespace mray
