// Rays of an image are found among any rays.
#include "library/queries/ray_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

namespace mray::test {
namespace {

using morphray::Ray;
using morphray::detail::find_grid;
using morphray::detail::find_tiled_places;

std::vector<Ray> image_rays(int width, int height) {
    std::vector<Ray> rays;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            rays.push_back(
                {.org = {1, 2, 3},
                 .dir = {static_cast<float>(x) / 50 - 1, static_cast<float>(y) / 50, -1}});
        }
    }
    return rays;
}

TEST(RayGrid, HasTheSidesOfTheImage) {
    for (const auto& [width, height] : {std::pair{16, 16}, {100, 75}, {1000, 20}}) {
        const auto grid = find_grid(image_rays(width, height));
        EXPECT_EQ(grid.row, static_cast<std::size_t>(width));
        EXPECT_EQ(grid.rows, static_cast<std::size_t>(height));
    }
    // A last row that is cut off does not count.
    std::vector<Ray> rays = image_rays(100, 75);
    rays.resize(rays.size() - 7);
    EXPECT_EQ(find_grid(rays).rows, 74u);
}

TEST(RayGrid, IsNotFoundElsewhere) {
    EXPECT_EQ(find_grid({}).row, 0u);
    EXPECT_EQ(find_grid(image_rays(15, 15)).row, 0u);
    // One row that does not return, and rows that are too short.
    EXPECT_EQ(find_grid(image_rays(400, 1)).row, 0u);
    EXPECT_EQ(find_grid(image_rays(8, 100)).row, 0u);
    std::vector<Ray> rays = image_rays(100, 75);
    rays.back().org.x += 1;
    EXPECT_EQ(find_grid(rays).row, 0u);
    rays = image_rays(100, 75);
    rays[40].dir.x = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(find_grid(rays).row, 0u);
    for (Ray& ray : rays) ray.dir = {0, 0, 1};
    EXPECT_EQ(find_grid(rays).row, 0u);
}

TEST(RayGrid, HasTilesOfNeighboursAndEachPlaceOnce) {
    for (const auto& [row, rows] : {std::pair{16, 16}, {100, 75}, {1000, 20}, {37, 8}, {40, 3}}) {
        const morphray::detail::RayGrid grid{static_cast<std::size_t>(row),
                                             static_cast<std::size_t>(rows)};
        // A last row is cut off.
        const std::size_t total = grid.row * grid.rows + grid.row / 2;
        std::vector<std::size_t> places(total);
        find_tiled_places(grid, 0, places);
        std::vector<int> times(total);
        for (const std::size_t place : places) ++times[place];
        EXPECT_EQ(times, std::vector<int>(total, 1)) << row;
        for (std::size_t i = 0; i < 64 && grid.rows >= 8; ++i)
            EXPECT_TRUE(places[i] % grid.row < 8 && places[i] / grid.row < 8) << row << ", " << i;
        // In parts of any size.
        for (const std::size_t size : {1u, 7u, 64u, 300u}) {
            std::vector<std::size_t> part;
            for (std::size_t begin = 0; begin < total; begin += size) {
                std::vector<std::size_t> some(std::min(size, total - begin));
                find_tiled_places(grid, begin, some);
                part.insert(part.end(), some.begin(), some.end());
            }
            EXPECT_EQ(part, places) << row << ", " << size;
        }
    }
}

}  // namespace
}  // namespace mray::test
