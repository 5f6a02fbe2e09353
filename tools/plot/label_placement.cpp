#include "tools/plot/label_placement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

namespace mray::plot {
namespace {

/// Half the size of a symbol, and the distance of its centre from its name, clear of a ring.
constexpr double kSymbol = 4;
constexpr double kGap = 12;
/// Names move up and down in steps of this part of their height, away from their point in steps of
/// this width.
constexpr double kStep = 0.25;
constexpr int kMostSteps = 80;
constexpr double kAway = 36;
constexpr int kMostAway = 6;

Box symbol_box(Point at) { return {at.x - kSymbol, at.y - kSymbol, 2 * kSymbol, 2 * kSymbol}; }

/// 0, -1, 1, -2, 2 ...
int alternating(int i) { return i % 2 == 1 ? -(i + 1) / 2 : i / 2; }

/// A line from a point to its name.
struct Leader {
    Point from;
    Point to;
};

Leader leader_to(Point at, const Box& box) {
    return {at, {box.left > at.x ? box.left : box.right(), box.top + box.height / 2}};
}

/// Whether a line meets the inside of a box, by the part of the line that is between the sides.
bool crosses(const Leader& line, const Box& box) {
    double begin = 0;
    double end = 1;
    const auto cut = [&](double from, double to, double low, double high) {
        if (from == to) {
            if (from <= low || from >= high) end = 0;
            return;
        }
        const double a = (low - from) / (to - from);
        const double b = (high - from) / (to - from);
        begin = std::max(begin, std::min(a, b));
        end = std::min(end, std::max(a, b));
    };
    cut(line.from.x, line.to.x, box.left, box.right());
    cut(line.from.y, line.to.y, box.top, box.bottom());
    return begin < end;
}

class NamePlacer {
public:
    NamePlacer(std::span<const NameRequest> requests, const Box& area) : area_(area) {
        for (const NameRequest& request : requests) symbols_.push_back(symbol_box(request.at));
    }

    PlacedName place(const NameRequest& request) {
        for (const bool lines_may_cross : {false, true}) {
            if (const std::optional<PlacedName> found = find(request, lines_may_cross)) {
                names_.push_back(found->box);
                if (found->has_leader) leaders_.push_back(leader_to(request.at, found->box));
                return *found;
            }
        }
        return {beside(request, true, kGap, 0), false};
    }

private:
    /// The free place that is nearest to the point.
    std::optional<PlacedName> find(const NameRequest& request, bool lines_may_cross) const {
        std::optional<PlacedName> nearest;
        double least = std::numeric_limits<double>::infinity();
        for (int away = 0; away < kMostAway; ++away) {
            for (int i = 0; i < 2 * kMostSteps; ++i) {
                const double shift = alternating(i) * kStep * request.height;
                const bool is_beside = std::abs(shift) <= request.height / 2;
                const double reach = (is_beside ? kGap : 2 * kGap) + away * kAway;
                const double distance = std::hypot(reach, shift);
                for (const bool right : {true, false}) {
                    const PlacedName place{beside(request, right, reach, shift),
                                           away > 0 || !is_beside};
                    if (distance < least && is_free(place.box) &&
                        (lines_may_cross || is_clear_of_lines(request.at, place))) {
                        least = distance;
                        nearest = place;
                    }
                }
            }
        }
        return nearest;
    }

    static Box beside(const NameRequest& request, bool right, double reach, double shift) {
        const double left = right ? request.at.x + reach : request.at.x - reach - request.width;
        return {left, request.at.y - request.height / 2 + shift, request.width, request.height};
    }

    bool is_free(const Box& box) const {
        const auto meets = [&](const Box& other) { return other.overlaps(box); };
        return area_.contains(box) && std::ranges::none_of(symbols_, meets) &&
               std::ranges::none_of(names_, meets);
    }

    /// Whether no line crosses the name, and the line to it, if it has one, crosses no other name.
    bool is_clear_of_lines(Point at, const PlacedName& place) const {
        const Leader own = leader_to(at, place.box);
        return std::ranges::none_of(leaders_,
                                    [&](const Leader& l) { return crosses(l, place.box); }) &&
               (!place.has_leader ||
                std::ranges::none_of(names_, [&](const Box& name) { return crosses(own, name); }));
    }

    Box area_;
    std::vector<Box> symbols_;
    std::vector<Box> names_;
    std::vector<Leader> leaders_;
};

}  // namespace

std::vector<PlacedName> place_names(std::span<const NameRequest> requests, const Box& area) {
    // In turn from bottom to top, so that lines to names do not cross. The lowest have the least
    // room: in charts of speed the slow are many.
    std::vector<std::size_t> order(requests.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(
        order, [&](std::size_t a, std::size_t b) { return requests[a].at.y > requests[b].at.y; });
    NamePlacer placer(requests, area);
    std::vector<PlacedName> placed(requests.size());
    for (const std::size_t index : order) placed[index] = placer.place(requests[index]);
    return placed;
}

}  // namespace mray::plot
