#include "scenes/polygons/triangulate.h"

#include <gmpxx.h>

#include <algorithm>
#include <cmath>
#include <compare>
#include <list>
#include <map>
#include <numeric>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace mray {
namespace {

struct PlanePoint {
    double x = 0;
    double y = 0;
    auto operator<=>(const PlanePoint&) const = default;
};

/// 1 if c is left of the line from a to b, -1 right of it, 0 within `tolerance` of it. Exact
/// without tolerance for coordinates that are floats.
int side(PlanePoint a, PlanePoint b, PlanePoint c, double tolerance = 0) {
    const double left = (b.x - a.x) * (c.y - a.y);
    const double right = (b.y - a.y) * (c.x - a.x);
    const double area = left - right;
    // Versions of glibc differ in the last bit of hypot().
    const double length = std::sqrt((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y));
    if (tolerance > 0 && std::abs(area) <= tolerance * length) return 0;
    // Seven roundings of 2^-53 each: less than 2^-50. Products that are 0 are exact.
    if (left == 0 || right == 0 || std::abs(area) > 0x1p-50 * (std::abs(left) + std::abs(right)))
        return area > 0 ? 1 : area < 0 ? -1 : 0;
    const auto difference = [](double from, double to) -> mpz_class {
        return mpz_class(std::ldexp(to, 149)) - mpz_class(std::ldexp(from, 149));
    };
    return cmp(difference(a.x, b.x) * difference(a.y, c.y),
               difference(a.y, b.y) * difference(a.x, c.x));
}

/// Triangulates where the winding number of a closed curve is not 0, if it is 1 or -1 there.
///
/// A line sweeps over the distinct points. Edges on one another become segments with the sum of
/// their weights. A segment is split at points that touch it from inside. Intervals between
/// segments keep the chain of their points that are not triangulated yet, from the lower to the
/// upper segment: they rise to the last one that the line met, then fall.
///
/// Based on: S. Hertel, K. Mehlhorn. Fast triangulation of simple polygons. 1983. Changed: edges
/// may lie on one another and points coincide.
class PolygonSweep {
public:
    /// Points within `tolerance` of a segment are on it.
    PolygonSweep(std::span<const PlanePoint> points, double tolerance)
        : tolerance_(tolerance), event_(points.size()) {
        std::vector<std::uint32_t> order(points.size());
        std::iota(order.begin(), order.end(), 0u);
        std::ranges::stable_sort(order, {}, [&](std::uint32_t i) { return points[i]; });
        for (const std::uint32_t corner : order) {
            if (at_.empty() || at_.back() != points[corner]) {
                at_.push_back(points[corner]);
                corner_.push_back(corner);
            }
            event_[corner] = static_cast<std::uint32_t>(at_.size() - 1);
        }
        starts_.resize(at_.size());
    }
    /// n - 2 triangles of n > 3 points; none if the winding number has other values.
    std::vector<uvec3> triangulate() {
        const std::size_t count = event_.size() - 2;
        set_starts();
        for (std::uint32_t event = 0; is_valid_ && event < at_.size(); ++event) {
            const auto [first, last] = touched(event);
            pass(event, first, last);
        }
        if (!is_valid_ || !status_.empty() || triangles_.size() > count) return {};
        stitches_.resize(std::min(stitches_.size(), count - triangles_.size()));
        triangles_.insert(triangles_.end(), stitches_.begin(), stitches_.end());
        triangles_.resize(count, uvec3(corner_[0]));
        return std::move(triangles_);
    }

private:
    /// Edges from one point in one direction. An edge from left to right weighs 1.
    struct Bundle {
        /// The sum of the weights of those that end at a point.
        std::map<std::uint32_t, int> ends;
        /// Of all.
        int weight = 0;

        std::uint32_t nearest() const { return ends.begin()->first; }
        /// Whether it is the two sides of one, if the inside is around it.
        bool is_slit() const {
            return ends.size() == 2 && weight == 0 && std::abs(ends.begin()->second) == 1;
        }
    };
    using Chain = std::list<std::uint32_t>;
    struct Line {
        std::uint32_t from = 0;
        std::uint32_t to = 0;
        int weight = 0;
    };
    struct Segment {
        Bundle edges;
        /// Of the interval above.
        Chain chain;
        Chain::iterator last;
    };
    struct Below {
        using is_transparent = void;
        const PolygonSweep* sweep;
        bool operator()(Line a, std::uint32_t event) const { return sweep->turn(a, event) > 0; }
        bool operator()(Line a, Line b) const {
            const bool swaps = a.from > b.from;
            if (swaps) std::swap(a, b);
            int turn = sweep->turn(a, b.from);
            if (turn == 0) turn = sweep->turn(a, b.to);
            // Both sides of a slit, with the inside beyond.
            if (turn == 0) turn = (b.weight - a.weight) * sweep->sign_;
            return swaps ? turn < 0 : turn > 0;
        }
    };
    using Status = std::map<Line, Segment, Below>;

    int turn(Line line, std::uint32_t event) const {
        return side(at_[line.from], at_[line.to], at_[event], tolerance_);
    }
    bool is_inside_above(const Line& line) const { return line.weight == sign_; }

    /// Cuts corners that are there twice in a row and tips of spikes; the others have edges.
    void set_starts() {
        const auto count = static_cast<std::uint32_t>(event_.size());
        std::vector<std::uint32_t> next(count);
        std::vector<std::uint32_t> previous(count);
        for (std::uint32_t i = 0; i < count; ++i)
            next[previous[(i + 1) % count] = i] = (i + 1) % count;
        std::uint32_t corner = 0;
        for (std::uint32_t left = count, unchanged = 0; unchanged < left; ++unchanged) {
            const std::uint32_t before = previous[corner];
            const std::uint32_t after = next[corner];
            const std::uint32_t a = event_[before];
            const std::uint32_t b = event_[corner];
            const std::uint32_t c = event_[after];
            corner = after;
            if (left == 3 || (a != b && b != c && ((a < b) != (c < b) || turn({a, b}, c) != 0)))
                continue;
            triangles_.emplace_back(before, previous[after], after);
            next[before] = after;
            previous[after] = before;
            --left;
            unchanged = 0;
            corner = before;
        }
        const std::uint32_t end = corner;
        do {
            const auto [from, to] = std::minmax(event_[corner], event_[next[corner]]);
            if (from != to) {
                const int weight = from == event_[corner] ? 1 : -1;
                starts_[from].push_back({{{to, weight}}, weight});
            }
            corner = next[corner];
        } while (corner != end);
    }
    /// Edges go on at `at`. Triangles without area between their ends keep the mesh closed.
    void pass_on(std::uint32_t from, std::uint32_t at, Bundle edges) {
        if (const auto ended = edges.ends.extract(at)) edges.weight -= ended.mapped();
        if (edges.ends.empty()) return;
        for (auto i = edges.ends.begin(); i != edges.ends.end() && stitches_.size() < event_.size();
             ++i) {
            const uvec3 stitch(corner_[from], corner_[i->first], corner_[at]);
            stitches_.insert(stitches_.end(), static_cast<std::size_t>(std::abs(i->second)),
                             i->second > 0 ? stitch : uvec3(stitch.y, stitch.x, stitch.z));
        }
        starts_[at].push_back(std::move(edges));
    }
    /// Sorts the edges from a point from the lowest to the highest, one bundle a direction.
    void sort_starts(std::uint32_t event) {
        std::vector<Bundle>& starts = starts_[event];
        std::sort(starts.begin(), starts.end(), [&](const Bundle& a, const Bundle& b) {
            return side(at_[event], at_[a.nearest()], at_[b.nearest()]) > 0;
        });
        std::vector<Bundle> sorted;
        for (Bundle& edges : starts) {
            if (sorted.empty() || turn({event, sorted.back().nearest()}, edges.nearest()) != 0) {
                sorted.push_back(std::move(edges));
                continue;
            }
            Bundle& into = sorted.back();
            if (into.ends.size() < edges.ends.size()) std::swap(into, edges);
            into.weight += edges.weight;
            for (const auto& [to, weight] : edges.ends)
                if ((into.ends[to] += weight) == 0) into.ends.erase(to);
            if (into.ends.empty()) sorted.pop_back();
        }
        starts.swap(sorted);
    }

    /// The segments that end at a point, or are split there and begin again.
    std::pair<Status::iterator, Status::iterator> touched(std::uint32_t event) {
        auto first = status_.lower_bound(event);
        auto last = first;
        for (; last != status_.end() && turn(last->first, event) == 0; ++last)
            if (last->first.to == event)
                pass_on(last->first.from, event, std::move(last->second.edges));
        sort_starts(event);
        // What touches a segment from outside does not split it.
        const auto passes = [&](const Line& line) {
            const int inside = is_inside_above(line) ? 1 : -1;
            return line.to != event &&
                   std::ranges::none_of(starts_[event], [&](const Bundle& edges) {
                       return edges.weight != 0 && turn(line, edges.nearest()) == inside;
                   });
        };
        while (first != last && !is_inside_above(first->first) && passes(first->first)) ++first;
        while (first != last && is_inside_above(std::prev(last)->first) &&
               passes(std::prev(last)->first))
            --last;
        for (auto segment = first; segment != last; ++segment)
            if (segment->first.to != event)
                pass_on(segment->first.from, event, std::move(segment->second.edges));
        sort_starts(event);
        return {first, last};
    }

    void add(std::uint32_t low, std::uint32_t event, std::uint32_t high) {
        is_valid_ = is_valid_ && side(at_[low], at_[event], at_[high], tolerance_) >= 0;
        if (sign_ < 0) std::swap(low, high);
        triangles_.emplace_back(corner_[low], corner_[event], corner_[high]);
    }
    /// Adds to one end of a chain a point, which sees those up to the last, if not farther.
    void extend(Chain& chain, std::uint32_t event, bool is_lower) {
        for (bool rises = true; chain.size() > 1;) {
            const std::uint32_t end = is_lower ? chain.front() : chain.back();
            const std::uint32_t next =
                is_lower ? *std::next(chain.begin()) : *std::prev(chain.end(), 2);
            const auto [low, high] = is_lower ? std::pair(end, next) : std::pair(next, end);
            rises = rises && next > end;
            if (!rises && side(at_[low], at_[event], at_[high]) <= 0) break;
            add(low, event, high);
            chain.erase(is_lower ? chain.begin() : std::prev(chain.end()));
        }
        chain.insert(is_lower ? chain.begin() : chain.end(), event);
    }
    /// Moves the line over a point. The chains beside it are empty outside.
    void pass(std::uint32_t event, Status::iterator first, Status::iterator last) {
        const auto below = first == status_.begin() ? status_.end() : std::prev(first);
        const bool is_inside = below != status_.end() && is_inside_above(below->first);
        const bool starts = std::ranges::any_of(starts_[event], [](const Bundle& edges) {
            return edges.weight != 0 || edges.is_slit();
        });
        Chain lower, upper;
        if (is_inside && (first != last || starts)) {
            lower.swap(below->second.chain);
            if (first == last) {
                upper.splice(upper.end(), lower, below->second.last, lower.end());
                lower.push_back(upper.front());
                extend(upper, event, true);
            }
            extend(lower, event, false);
        }
        for (auto segment = first; segment != last; ++segment) {
            if (!is_inside_above(segment->first)) continue;
            upper.swap(segment->second.chain);
            if (std::next(segment) == last) {
                extend(upper, event, true);
            } else {
                for (auto i = upper.begin(); std::next(i) != upper.end(); ++i)
                    add(*i, event, *std::next(i));
                upper.clear();
            }
        }
        status_.erase(first, last);
        const auto highest = start(event, below, last, !lower.empty());
        is_valid_ =
            is_valid_ && (highest == below ? lower.empty() == upper.empty()
                                           : is_inside_above(highest->first) != upper.empty());
        if (!is_valid_) return;
        if (!lower.empty()) {
            below->second.last = std::prev(lower.end());
            below->second.chain.swap(lower);
        }
        if (upper.empty()) return;
        if (highest == below) {
            // The intervals below and above become one.
            upper.pop_front();
            below->second.chain.splice(below->second.chain.end(), upper);
        } else {
            highest->second.last = upper.begin();
            highest->second.chain.swap(upper);
        }
    }
    /// Returns the highest segment that starts at the point; `below` if there is none.
    Status::iterator start(std::uint32_t event, Status::iterator below, Status::iterator above,
                           bool is_inside) {
        int winding = is_inside ? sign_ : 0;
        auto highest = below;
        const auto add_segment = [&](std::uint32_t to, Bundle edges) {
            const Line line = {event, to, edges.weight};
            winding += line.weight;
            if (sign_ == 0) sign_ = winding;
            const std::size_t size = status_.size();
            highest = status_.emplace_hint(above, line, Segment{std::move(edges), {}, {}});
            is_valid_ = is_valid_ && std::abs(line.weight) == 1 && status_.size() > size &&
                        (winding == 0 || winding == sign_);
            if (winding != 0) highest->second.chain = {event};
            highest->second.last = highest->second.chain.begin();
        };
        std::vector<Bundle> starts = std::move(starts_[event]);
        for (Bundle& edges : starts) {
            const std::uint32_t to = edges.nearest();
            if (edges.weight != 0) {
                add_segment(to, std::move(edges));
            } else if (winding == 0 || !edges.is_slit()) {
                pass_on(event, to, std::move(edges));
            } else {
                for (const int weight : {-sign_, sign_})
                    for (const auto& end : edges.ends)
                        if (end.second == weight) add_segment(end.first, {{end}, weight});
            }
        }
        return highest;
    }

    double tolerance_ = 0;
    bool is_valid_ = true;
    /// 1 or -1: the winding number inside; 0 before it is known.
    int sign_ = 0;
    /// By corner.
    std::vector<std::uint32_t> event_;
    /// By event, in the order of x, then y.
    std::vector<PlanePoint> at_;
    std::vector<std::uint32_t> corner_;
    std::vector<std::vector<Bundle>> starts_;
    Status status_{Below{this}};
    std::vector<uvec3> triangles_, stitches_;
};

using Corners = std::span<const std::uint32_t>;

// Newell's (M. E. Newell et al. 1972), relative to the first corner for the sake of digits. For a
// sum of 0, as of a bow tie, that of the sizes tells in which plane the face has area.
glm::dvec3 face_normal(Corners corners, std::span<const vec3> positions) {
    const glm::dvec3 origin(positions[corners[0]]);
    glm::dvec3 sum(0.0);
    glm::dvec3 sizes(0.0);
    glm::dvec3 last(0.0);
    for (const std::uint32_t corner : corners) {
        const glm::dvec3 p = glm::dvec3(positions[corner]) - origin;
        sum += glm::cross(last, p);
        sizes += glm::abs(glm::cross(last, p));
        last = p;
    }
    return sum == glm::dvec3(0.0) ? sizes : sum;
}

// Projects along the axis in which the face is largest, which keeps coordinates exact, and makes it
// counter-clockwise. Returns false for no area or what is not finite.
bool project(Corners corners, std::span<const vec3> positions, std::vector<PlanePoint>& points) {
    const glm::dvec3 normal = face_normal(corners, positions);
    int dropped = 0;
    for (int axis = 1; axis < 3; ++axis)
        if (std::abs(normal[axis]) > std::abs(normal[dropped])) dropped = axis;
    if (normal[dropped] == 0) return false;
    int x = (dropped + 1) % 3;
    int y = (dropped + 2) % 3;
    if (normal[dropped] < 0) std::swap(x, y);
    points.clear();
    for (const std::uint32_t corner : corners) {
        const vec3 p = positions[corner];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) return false;
        points.push_back({p[x], p[y]});
    }
    return true;
}

/// Whether the triangles of the first corner turn left, and not beyond where they began.
bool fan_covers(std::span<const PlanePoint> points) {
    bool is_past_half = false;
    for (std::size_t i = 1; i + 1 < points.size(); ++i) {
        const int turn = side(points[0], points[1], points[i + 1]);
        if (side(points[0], points[i], points[i + 1]) <= 0 || (is_past_half && turn >= 0))
            return false;
        is_past_half = is_past_half || turn < 0;
    }
    return true;
}

/// Triangles of points that a fan does not cover, or none. Where edges cross a little, most of the
/// polygon still comes out right; `crosses` is set if more than roundings would have to move.
std::vector<uvec3> sweep(std::span<const PlanePoint> points, bool& crosses) {
    double largest = 0;
    double extent = 0;
    for (const PlanePoint& p : points) {
        largest = std::max({largest, std::abs(p.x), std::abs(p.y)});
        extent = std::max({extent, std::abs(p.x - points[0].x), std::abs(p.y - points[0].y)});
    }
    const double rounding = std::ldexp(largest, -22);
    std::vector<uvec3> triangles = PolygonSweep(points, 0).triangulate();
    for (double reach = rounding; triangles.empty() && reach < extent; reach *= 16) {
        triangles = PolygonSweep(points, reach).triangulate();
        crosses = triangles.empty() || reach > rounding;
    }
    return triangles;
}

}  // namespace

std::vector<uvec3> triangulate(const Polygons& faces, std::span<const vec3> positions,
                               std::vector<uvec3>* corners_of_triangles,
                               std::vector<std::size_t>* crossing) {
    std::vector<uvec3> triangles;
    triangles.reserve(faces.corners.size() - 2 * faces.corner_counts.size());
    std::vector<PlanePoint> points;
    std::vector<uvec3> ears;
    std::uint32_t first = 0;
    std::size_t polygon = 0;
    for (std::size_t face = 0; face < faces.corner_counts.size(); ++face) {
        const std::uint32_t count = faces.corner_counts[face];
        const Corners corners(faces.corners.data() + first, count);
        const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            triangles.emplace_back(corners[a], corners[b], corners[c]);
            if (corners_of_triangles != nullptr)
                corners_of_triangles->emplace_back(first + a, first + b, first + c);
        };
        const bool is_fan =
            count == 3 || !project(corners, positions, points) || fan_covers(points);
        ears.clear();
        bool crosses = false;
        if (!is_fan) ears = sweep(points, crosses);
        for (std::uint32_t i = 1; ears.empty() && i + 1 < count; ++i) add(0, i, i + 1);
        for (const uvec3& ear : ears) add(ear.x, ear.y, ear.z);
        if (crosses && crossing != nullptr) crossing->push_back(polygon);
        if (count > 3) ++polygon;
        first += count;
    }
    return triangles;
}

}  // namespace mray
