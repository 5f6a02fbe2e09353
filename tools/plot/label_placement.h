// Places names beside points so that no two overlap. Units are pixels, y points down.
#pragma once

#include <span>
#include <vector>

#include "tools/plot/figure.h"

namespace mray::plot {

struct Box {
    double left = 0;
    double top = 0;
    double width = 0;
    double height = 0;

    double right() const { return left + width; }
    double bottom() const { return top + height; }
    /// Whether the insides meet.
    bool overlaps(const Box& other) const {
        return left < other.right() && other.left < right() && top < other.bottom() &&
               other.top < bottom();
    }
    bool contains(const Box& other) const {
        return other.left >= left && other.right() <= right() && other.top >= top &&
               other.bottom() <= bottom();
    }
};

/// A point and the size of the name that it needs.
struct NameRequest {
    Point at;
    double width = 0;
    double height = 0;
};

struct PlacedName {
    Box box;
    /// Whether the name stands so far from its point that a line must lead to it.
    bool has_leader = false;
};

/// A place for each request: beside its point, or moved up, down and away from it. Names keep
/// within `area` and clear of each other, of all points and of the lines to other names, as long as
/// the area has room; lines cross names before names meet, and a name without room stands at its
/// point whatever is there.
std::vector<PlacedName> place_names(std::span<const NameRequest> requests, const Box& area);

}  // namespace mray::plot
