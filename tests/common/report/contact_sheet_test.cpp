// Contact sheets show each image, scaled down.
#include "common/report/contact_sheet.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/noise_image.h"

namespace mray {
namespace {

Image uniform(std::uint32_t width, std::uint32_t height, std::uint32_t pixel) {
    return {width, height, std::vector<std::uint32_t>(std::size_t{width} * height, pixel)};
}

TEST(ContactSheet, OfOneSmallImageIsThatImage) {
    const std::vector<Image> images = {test::noise(30, 20, 0, 3)};
    const Image sheet = contact_sheet(images);
    EXPECT_EQ(sheet.width, 30u);
    EXPECT_EQ(sheet.height, 20u);
    EXPECT_EQ(sheet.pixels, images[0].pixels);
}

TEST(ContactSheet, HoldsTheImagesRowByRow) {
    std::vector<Image> images;
    for (std::uint32_t i = 0; i < 4; ++i) images.push_back(uniform(8, 8, 0xFF000000 + i));
    const Image sheet = contact_sheet(images);
    ASSERT_GT(sheet.width, 16u);
    ASSERT_GT(sheet.height, 16u);
    const auto at = [&](std::uint32_t x, std::uint32_t y) {
        return sheet.pixels[y * sheet.width + x];
    };
    EXPECT_EQ(at(0, 0), 0xFF000000u);
    EXPECT_EQ(at(sheet.width - 1, 0), 0xFF000001u);
    EXPECT_EQ(at(0, sheet.height - 1), 0xFF000002u);
    EXPECT_EQ(at(sheet.width - 1, sheet.height - 1), 0xFF000003u);
}

TEST(ContactSheet, ScalesDownByTheMeanOfEachBlock) {
    Image image{4, 2, {10, 20, 1, 1, 30, 40, 1, 2}};
    const Image sheet = contact_sheet(std::vector<Image>{image}, 2);
    EXPECT_EQ(sheet.width, 2u);
    EXPECT_EQ(sheet.height, 1u);
    EXPECT_EQ(sheet.pixels, (std::vector<std::uint32_t>{25, 1}));
}

TEST(ContactSheet, DoesNotDarkenAnIncompleteBlockAtTheEdge) {
    const Image sheet = contact_sheet(std::vector<Image>{uniform(5, 5, 0xFF646464)}, 2);
    // Blocks of 3 x 3 pixels, of which only the first is complete.
    EXPECT_EQ(sheet.width, 2u);
    EXPECT_EQ(sheet.height, 2u);
    EXPECT_EQ(sheet.pixels, std::vector<std::uint32_t>(4, 0xFF646464));
}

}  // namespace
}  // namespace mray
