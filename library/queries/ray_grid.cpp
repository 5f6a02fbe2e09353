#include "library/queries/ray_grid.h"

#include <algorithm>
#include <cmath>

namespace morphray::detail {
namespace {

// Images that are smaller gain nothing.
constexpr std::size_t kLeastSide = 16;
constexpr std::size_t kMostRow = std::size_t{1} << 16;
// The rays of a tile are a stream (cpu/single_ray/ray_stream-inl.h).
constexpr std::size_t kTileSide = 8;

struct Direction {
    double x, y, z;
};

Direction unit(const Vec3& dir) {
    const double x = dir.x;
    const double y = dir.y;
    const double z = dir.z;
    const double scale = 1 / std::sqrt(x * x + y * y + z * z);
    return {x * scale, y * scale, z * scale};
}

Direction operator-(const Direction& a, const Direction& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}

double dot(const Direction& a, const Direction& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

}  // namespace

RayGrid find_grid(std::span<const Ray> rays) {
    if (rays.size() < kLeastSide * kLeastSide) return {};
    const Vec3 org = rays.front().org;
    if (!(rays[rays.size() / 2].org == org) || !(rays.back().org == org)) return {};
    Direction before = unit(rays[0].dir);
    // The last step: over a wide field of view the first one turns by more than a right angle.
    Direction step = unit(rays[1].dir) - before;
    const std::size_t most = std::min(rays.size() / kLeastSide + 1, kMostRow);
    for (std::size_t i = 1; i < most; ++i) {
        const Direction next = unit(rays[i].dir);
        const Direction next_step = next - before;
        const double forward = dot(next_step, step);
        if (forward < 0 && i >= kLeastSide) return {i, rays.size() / i};
        // Also for directions that are no numbers.
        if (!(forward > 0)) return {};
        before = next;
        step = next_step;
    }
    return {};
}

void find_tiled_places(const RayGrid& grid, std::size_t begin, std::span<std::size_t> places) {
    const std::size_t band_size = kTileSide * grid.row;
    const std::size_t tiled = grid.rows / kTileSide * band_size;
    std::size_t filled = 0;
    while (filled < places.size() && begin + filled < tiled) {
        // The rest of a tile. Columns beside the tiles are a narrower one.
        const std::size_t in_band = (begin + filled) % band_size;
        const std::size_t x = in_band / (kTileSide * kTileSide) * kTileSide;
        const std::size_t width = std::min(kTileSide, grid.row - x);
        const std::size_t in_tile = in_band - x * kTileSide;
        const std::size_t corner = begin + filled - in_band + x;
        std::size_t column = in_tile % width;
        for (std::size_t y = in_tile / width; y < kTileSide && filled < places.size(); ++y) {
            for (; column < width && filled < places.size(); ++column)
                places[filled++] = corner + y * grid.row + column;
            column = 0;
        }
    }
    for (; filled < places.size(); ++filled) places[filled] = begin + filled;
}

}  // namespace morphray::detail
