// The comparison of two PNG files.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "common/image/png.h"
#include "tests/app/program.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;

Image ramp(std::uint32_t width, std::uint32_t height) {
    Image image{width, height, {}};
    for (std::uint32_t i = 0; i < width * height; ++i)
        image.pixels.push_back(0xFF000000u | (i * 7 % 200) | (i % 100) << 8 | (i % 50) << 16);
    return image;
}

std::string write_png(const TemporaryFolder& folder, const std::string& name, const Image& image) {
    const std::vector<std::byte> png = encode_png(image);
    return folder.write(name, std::string(reinterpret_cast<const char*>(png.data()), png.size()))
        .native();
}

TEST(PngDiff, FindsEqualImagesEqual) {
    const TemporaryFolder folder;
    const std::string a = write_png(folder, "a.png", ramp(20, 10));
    const std::string b = write_png(folder, "b.PNG", ramp(20, 10));
    const Outcome outcome = run({"diff", a, b});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.out, "image of 20x10: equal bit by bit\n");
}

TEST(PngDiff, CountsPixelsAndNamesTheLargestDifferenceOfEachChannel) {
    const TemporaryFolder folder;
    const std::string a = write_png(folder, "a.png", ramp(20, 10));
    Image changed = ramp(20, 10);
    changed.pixels[3 * 20 + 4] += 2;         // red
    changed.pixels[5 * 20 + 6] += 9;         // red, more
    changed.pixels[7 * 20 + 8] -= 1u << 16;  // blue
    const std::string b = write_png(folder, "b.png", changed);
    const Outcome text = run({"diff", a, b});
    EXPECT_EQ(text.code, 1) << text.err;
    for (const char* part :
         {"image of 20x10: 3 pixels differ of 200\n", "red    at most 9, by +9 at pixel 6,5\n",
          "green  equal\n", "blue   at most 1, by -1 at pixel 8,7\n", "alpha  equal\n",
          "pixel 4,3: expected #"}) {
        EXPECT_NE(text.out.find(part), std::string::npos) << part << text.out;
    }
    const Json json = Json::parse(run({"diff", a, b, "--json", "-"}).out);
    EXPECT_EQ(json["differing_pixels"], 3);
    EXPECT_EQ(json["channels"]["red"]["difference"], 9);
    EXPECT_EQ(json["channels"]["red"]["pixel"], Json({6, 5}));
    EXPECT_EQ(json["channels"]["blue"]["difference"], -1);
    EXPECT_EQ(json["first"].size(), 3u);
    EXPECT_EQ(json["equal"], false);
}

TEST(PngDiff, SeesAlpha) {
    const TemporaryFolder folder;
    Image image = ramp(4, 4);
    const std::string a = write_png(folder, "a.png", image);
    image.pixels[5] &= 0xFEFFFFFF;
    const std::string b = write_png(folder, "b.png", image);
    const Json json = Json::parse(run({"diff", a, b, "--json", "-"}).out);
    EXPECT_EQ(json["channels"]["alpha"]["difference"], -1);
    EXPECT_EQ(json["differing_pixels"], 1);
}

TEST(PngDiff, RefusesADamagedText) {
    const TemporaryFolder folder;
    const PngText text{"Software", "morphray"};
    const auto encoded = encode_png(ramp(4, 4), {&text, 1});
    std::string bytes(reinterpret_cast<const char*>(encoded.data()), encoded.size());
    const std::string a = folder.write("a.png", bytes).native();
    EXPECT_EQ(run({"diff", a, a}).code, 0);
    bytes[bytes.find("morphray")] ^= 1;
    const std::string b = folder.write("b.png", bytes).native();
    const Outcome outcome = run({"diff", a, b});
    EXPECT_EQ(outcome.code, 3) << outcome.out;
    EXPECT_EQ(outcome.err,
              b + ": is not a PNG file that can be read (iTXt: CRC error); give another file\n");
}

TEST(PngDiff, RefusesWhatCannotBeCompared) {
    const TemporaryFolder folder;
    const std::string a = write_png(folder, "a.png", ramp(20, 10));
    const std::string small = write_png(folder, "small.png", ramp(8, 8));
    const std::string bytes = read_file(a);
    std::string damaged = bytes;
    damaged[60] ^= 1;
    const auto expect_refused = [&](const std::string& other, const std::string& text) {
        const Outcome outcome = run({"diff", a, other});
        EXPECT_EQ(outcome.code, 3) << outcome.err;
        EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
        EXPECT_TRUE(outcome.err.starts_with(other)) << outcome.err;
        EXPECT_NE(outcome.err.find(text), std::string::npos) << outcome.err;
        EXPECT_EQ(outcome.out, "");
    };
    expect_refused(small, "only images of the same size");
    expect_refused(folder.file("none.png"), "no such file");
    expect_refused(folder.write("text.png", "hello"), "not a PNG file");
    expect_refused(folder.write("empty.png", ""), "not a PNG file");
    expect_refused(folder.write("cut.png", bytes.substr(0, bytes.size() / 2)), "too early");
    expect_refused(folder.write("damaged.png", damaged), "not a PNG file");
    expect_refused(folder.write("hits", "hello"), "two files of hits or two PNG");
}

}  // namespace
}  // namespace mray::test
