#include "tools/plot/label_placement.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace mray::plot {
namespace {

/// Half the size of a symbol, and its distance from its name.
constexpr double kSymbol = 4;
constexpr double kGap = 8;
/// Names move up and down in steps of this part of their height, away from their point in steps of
/// this width.
constexpr double kStep = 0.25;
constexpr int kMostSteps = 80;
constexpr double kAway = 36;
constexpr int kMostAway = 6;

Box symbol_box(Point at) { return {at.x - kSymbol, at.y - kSymbol, 2 * kSymbol, 2 * kSymbol}; }

/// 0, 1, -1, 2, -2 ...
int alternating(int i) { return i % 2 == 1 ? (i + 1) / 2 : -i / 2; }

class NamePlacer {
public:
    NamePlacer(std::span<const NameRequest> requests, const Box& area) : area_(area) {
        for (const NameRequest& request : requests) taken_.push_back(symbol_box(request.at));
    }

    PlacedName place(const NameRequest& request) {
        for (int away = 0; away < kMostAway; ++away) {
            for (int i = 0; i < 2 * kMostSteps; ++i) {
                const double shift = alternating(i) * kStep * request.height;
                const double reach = std::abs(shift) > request.height / 2 ? 2 * kGap : kGap;
                for (const bool right : {true, false}) {
                    const Box box = beside(request, right, reach + away * kAway, shift);
                    if (!is_free(box)) continue;
                    taken_.push_back(box);
                    return {box, away > 0 || std::abs(shift) > request.height / 2};
                }
            }
        }
        return {beside(request, true, kGap, 0), false};
    }

private:
    static Box beside(const NameRequest& request, bool right, double reach, double shift) {
        const double left = right ? request.at.x + reach : request.at.x - reach - request.width;
        return {left, request.at.y - request.height / 2 + shift, request.width, request.height};
    }

    bool is_free(const Box& box) const {
        return area_.contains(box) &&
               std::ranges::none_of(taken_, [&](const Box& other) { return other.overlaps(box); });
    }

    Box area_;
    std::vector<Box> taken_;
};

}  // namespace

std::vector<PlacedName> place_names(std::span<const NameRequest> requests, const Box& area) {
    // From top to bottom, so that lines to names do not cross.
    std::vector<std::size_t> order(requests.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(
        order, [&](std::size_t a, std::size_t b) { return requests[a].at.y < requests[b].at.y; });
    NamePlacer placer(requests, area);
    std::vector<PlacedName> placed(requests.size());
    for (const std::size_t index : order) placed[index] = placer.place(requests[index]);
    return placed;
}

}  // namespace mray::plot
