#include "lab/bench/full_window.h"

#include <cassert>
#include <cstdlib>
#include <optional>
#include <vector>

namespace mray::bench {
namespace {

/// Counts of hits in rectangles (F. C. Crow. Summed-area tables for texture mapping. 1984).
class SummedHits {
public:
    SummedHits(std::span<const std::uint8_t> hits, std::uint32_t side)
        : pitch_(side + 1), sums_(std::size_t{pitch_} * pitch_) {
        for (std::uint32_t y = 0; y < side; ++y) {
            std::uint32_t row = 0;
            for (std::uint32_t x = 0; x < side; ++x) {
                row += hits[std::size_t{y} * side + x];
                sum(x + 1, y + 1) = sum(x + 1, y) + row;
            }
        }
    }

    std::uint32_t count(std::uint32_t x, std::uint32_t y, std::uint32_t side) const {
        return sum(x + side, y + side) - sum(x, y + side) - sum(x + side, y) + sum(x, y);
    }

private:
    std::uint32_t& sum(std::uint32_t x, std::uint32_t y) {
        return sums_[std::size_t{y} * pitch_ + x];
    }
    std::uint32_t sum(std::uint32_t x, std::uint32_t y) const {
        return sums_[std::size_t{y} * pitch_ + x];
    }

    std::size_t pitch_;
    std::vector<std::uint32_t> sums_;
};

/// Twice the distance from the middle, along x and y together.
std::uint32_t off_middle(const Window& window, std::uint32_t side) {
    const auto off = [&](std::uint32_t begin) {
        return std::abs(static_cast<std::int64_t>(2 * begin + window.side) - side);
    };
    return static_cast<std::uint32_t>(off(window.x) + off(window.y));
}

}  // namespace

Window find_full_window(std::span<const std::uint8_t> hits, std::uint32_t side) {
    assert(side >= kMaxZoom && hits.size() == std::size_t{side} * side);
    const SummedHits summed(hits, side);
    std::optional<Window> fullest;
    for (std::uint32_t size = side; size >= side / kMaxZoom; --size) {
        std::optional<Window> full;
        for (std::uint32_t y = 0; y + size <= side; ++y) {
            for (std::uint32_t x = 0; x + size <= side; ++x) {
                const double share = double(summed.count(x, y, size)) / (double(size) * size);
                const Window window{x, y, size, share};
                if (!fullest || share > fullest->hit_share) fullest = window;
                if (share < kFullShare) continue;
                if (!full || off_middle(window, side) < off_middle(*full, side)) full = window;
            }
        }
        if (full) return *full;
    }
    return *fullest;
}

}  // namespace mray::bench
