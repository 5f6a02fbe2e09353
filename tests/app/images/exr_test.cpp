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

/// A channel of a file, converted to T.
template <class T>
std::vector<T> channel(const std::string& file, const char* name, Imf::PixelType type) {
    Imf::InputFile in(file.c_str());
    EXPECT_NE(in.header().channels().findChannel(name), nullptr) << name;
    std::vector<T> values(kSide * kSide);
    Imf::FrameBuffer buffer;
    buffer.insert(name, Imf::Slice(type, reinterpret_cast<char*>(values.data()), sizeof(T),
                                   sizeof(T) * kSide));
    in.setFrameBuffer(buffer);
    in.readPixels(0, kSide - 1);
    return values;
}

std::vector<float> floats(const std::string& file, const char* name) {
    return channel<float>(file, name, Imf::FLOAT);
}

Outcome render(const TemporaryFolder& folder, const char* out, const Words& more) {
    return run(words(
        "render builtin:cloth:800 --frames 9 --size 24x24 --backend cpu --out " + folder.file(out),
        more));
}

TEST(Exr, LayersAreThoseOfTheHits) {
    TemporaryFolder folder;
    const std::string hits_file = folder.file("a.hits");
    ASSERT_EQ(render(folder, "a", {"--exr", "float", "--hits", hits_file}).code, 0);
    const std::string file = folder.file("a/frame_0009.exr");
    const morphray::HitsFile hits = morphray::read_hits(hits_file);
    const auto depth = floats(file, "depth.Z");
    const auto u = floats(file, "barycentric.U");
    const auto v = floats(file, "barycentric.V");
    const auto prim = channel<unsigned>(file, "id.prim", Imf::UINT);
    const auto geom = channel<unsigned>(file, "id.geom", Imf::UINT);
    const auto x = floats(file, "normal.X");
    const auto y = floats(file, "normal.Y");
    const auto z = floats(file, "normal.Z");
    const auto occlusion = floats(file, "occlusion.Y");
    std::set<unsigned> prims;
    for (std::size_t i = 0; i < depth.size(); ++i) {
        const morphray::Hit& hit = hits.images[0].hits[i];
        EXPECT_EQ(depth[i], hit ? hit.t : INFINITY);
        EXPECT_EQ(u[i], hit.u);
        EXPECT_EQ(v[i], hit.v);
        EXPECT_EQ(prim[i], hit.prim_id);
        EXPECT_EQ(geom[i], hit ? 0u : 0xFFFFFFFFu);
        EXPECT_NEAR(x[i] * x[i] + y[i] * y[i] + z[i] * z[i], hit ? 1 : 0, 0.01);
        EXPECT_GE(occlusion[i], 0);
        EXPECT_LE(occlusion[i], hit ? 1 : 0);
        if (hit) prims.insert(hit.prim_id);
    }
    EXPECT_GT(prims.size(), 50u);
}

TEST(Exr, ColoursAreThoseOfThePngButLinear) {
    TemporaryFolder folder;
    ASSERT_EQ(render(folder, "float", {"--exr", "float"}).code, 0);
    ASSERT_EQ(render(folder, "half", {"--exr", "half", "--threads", "3", "--simd", "off"}).code, 0);
    const std::string precise = folder.file("float/frame_0009.exr");
    const std::string rough = folder.file("half/frame_0009.exr");
    float largest = 0;
    for (const char* name : {"R", "G", "B"}) {
        const auto a = floats(precise, name);
        const auto b = floats(rough, name);
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
    const auto geom = channel<unsigned>(folder.file("a/frame_0009.exr"), "id.geom", Imf::UINT);
    EXPECT_TRUE(std::set<unsigned>(geom.begin(), geom.end()).contains(1));
}

}  // namespace
}  // namespace mray::test
