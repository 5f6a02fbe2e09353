// Files of hits are read back as they were written, and others are refused.
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/library/scenes.h"
#include "tests/support/temporary_folder.h"

namespace mray::test {
namespace {

std::string bytes_of(const std::string& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(HitsFile, IsReadBackAsItWasWritten) {
    const TemporaryFolder folder;
    const std::string file = folder.write("a.hits", "").string();
    const UserMesh mesh(torus(24, 16));
    const morphray::Scene scene = morphray::Scene::build(mesh.view());
    const morphray::Image images[] = {
        scene.render({.width = 31, .height = 17}),
        scene.render({.width = 31, .height = 17, .rays = morphray::Rays::ao, .ao_count = 3})};
    morphray::HitsWriter writer(31, 17);
    for (const morphray::Image& image : images) writer.add(image);
    writer.write(file);
    EXPECT_EQ(bytes_of(file).size(), 20 + 2 * 31 * 17 * 20u);
    const morphray::HitsFile read = morphray::read_hits(file);
    EXPECT_EQ(read.width, 31u);
    EXPECT_EQ(read.height, 17u);
    ASSERT_EQ(read.images.size(), 2u);
    for (int i = 0; i < 2; ++i) {
        expect_same_hits(read.images[i].hits, images[i].hits);
        EXPECT_EQ(read.images[i].occlusion, images[i].occlusion);
        EXPECT_GT(count_hits(read.images[i].hits), 50u);
    }
}

TEST(HitsFile, HasImagesOfOneShape) {
    const UserMesh mesh(icosphere(2));
    const morphray::Scene scene = morphray::Scene::build(mesh.view());
    morphray::HitsWriter writer(8, 4);
    for (const auto& [width, height, samples] :
         {std::array{4u, 8u, 1u}, {16u, 2u, 1u}, {8u, 4u, 4u}, {2u, 4u, 4u}}) {
        const morphray::Image image =
            scene.render({.width = width, .height = height, .samples = samples});
        EXPECT_EQ(error_of([&] { writer.add(image); }), "bad_argument") << width;
    }
    writer.add(scene.render({.width = 8, .height = 4}));
    writer.add(scene.render({.width = 4, .height = 2, .samples = 4}));
}

}  // namespace
}  // namespace mray::test
