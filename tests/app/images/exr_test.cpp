// OpenEXR files of render, read back.
#include <gtest/gtest.h>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "morphray/images.hpp"
#include "tests/app/program.h"

namespace mray::test {
namespace {

constexpr int kSide = 24;

std::vector<float> channel(const std::string& file, const char* name) {
    Imf::InputFile in(file.c_str());
    EXPECT_NE(in.header().channels().findChannel(name), nullptr) << name;
    std::vector<float> values(kSide * kSide);
    Imf::FrameBuffer buffer;
    buffer.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()),
                                   sizeof(float), sizeof(float) * kSide));
    in.setFrameBuffer(buffer);
    in.readPixels(0, kSide - 1);
    return values;
}

Outcome render(const TemporaryFolder& folder, const char* out, const Words& more) {
    return run(words(
        "render builtin:cloth:800 --frames 9 --size 24x24 --backend cpu --out " + folder.file(out),
        more));
}

TEST(Exr, DepthsAreThoseOfTheHits) {
    TemporaryFolder folder;
    const std::string hits_file = folder.file("a.hits");
    ASSERT_EQ(render(folder, "a", {"--exr", "float", "--hits", hits_file}).code, 0);
    const std::string file = folder.file("a/frame_0009.exr");
    const morphray::HitsFile hits = morphray::read_hits(hits_file);
    const auto depth = channel(file, "depth.Z");
    std::set<float> depths;
    for (std::size_t i = 0; i < depth.size(); ++i) {
        const morphray::Hit& hit = hits.images[0].hits[i];
        EXPECT_EQ(depth[i], hit ? hit.t : INFINITY);
        if (hit) depths.insert(hit.t);
    }
    EXPECT_GT(depths.size(), 50u);
}

TEST(Exr, ColoursAreThoseOfThePngButLinear) {
    TemporaryFolder folder;
    ASSERT_EQ(render(folder, "float", {"--exr", "float"}).code, 0);
    ASSERT_EQ(render(folder, "half", {"--exr", "half", "--threads", "3", "--simd", "off"}).code, 0);
    const std::string precise = folder.file("float/frame_0009.exr");
    const std::string rough = folder.file("half/frame_0009.exr");
    float largest = 0;
    for (const char* name : {"R", "G", "B"}) {
        const auto a = channel(precise, name);
        const auto b = channel(rough, name);
        for (std::size_t i = 0; i < a.size(); ++i) {
            EXPECT_NEAR(a[i], b[i], 1e-3f);
            EXPECT_GE(a[i], 0);
            largest = std::max(largest, a[i]);
        }
    }
    EXPECT_GT(largest, 0.5f);
    EXPECT_EQ(read_file(folder.file("float/frame_0009.png")),
              read_file(folder.file("half/frame_0009.png")));
    Imf::InputFile in(precise.c_str());
    const auto* const source = in.header().findTypedAttribute<Imf::StringAttribute>("Source");
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(
        source->value(),
        "morphray render builtin:cloth:800 --frames 9 --size 24x24 --ao-samples 8 --shading lit "
        "--samples 4 --ground off");
}

TEST(Exr, TheBytesDoNotDependOnTheBackend) {
    TemporaryFolder folder;
    ASSERT_EQ(render(folder, "a", {"--exr", "half", "--ground", "on"}).code, 0);
    ASSERT_EQ(render(folder, "b", {"--exr", "half", "--ground", "on", "--simd", "off"}).code, 0);
    EXPECT_EQ(read_file(folder.file("a/frame_0009.exr")),
              read_file(folder.file("b/frame_0009.exr")));
}

}  // namespace
}  // namespace mray::test
