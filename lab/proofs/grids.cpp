// No operation of the hit rule or the slab test gives a denormal or overflows
// (docs/design/arithmetic.md, "No denormals").
//
//   bounds       every result is 0 or at least 2^-126, and finite
//   code         common/interop/hit_rule.h, slab.h, and rcp (arithmetic.h). Functions that take
//                floats are the code's text (rule_functions.h), others are written out here
//   inputs       vertices, origins and directions as common/scene/scene_space.h promises
//   method       multiples of powers of two and largest magnitudes
//   by hand      What a comment below says. Fast products x y may underflow and do not matter
//                (fast_edges.g, last lemma). surely_inside: where fl(depth_slack * sum) is a
//                denormal, it is less than bound >= 2^-98 either way. weighted_hit of fast
//                functions that surely_inside rejects may underflow or overflow, and t where z is
//                not certain: neither is used. surface.h, shading.h: left to tests.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string_view>

#include "lab/proofs/bounds.h"
#include "lab/proofs/rule_functions.h"

namespace mray::proofs {

/// x is 0, or a multiple of 2^quantum with least <= |x| <= most. If x is such a multiple, so is
/// fl(x): larger numbers round to multiples of larger powers of two.
struct Grid {
    int quantum = 0;
    double least = 1;
    double most = 0;

    Grid(int multiple_of, double at_most)
        : quantum(multiple_of), least(std::ldexp(1.0, multiple_of)), most(at_most) {}

    /// A float of at least this magnitude is a multiple of 2^-23 of its power of two.
    static Grid between(double at_least, double at_most) {
        Grid g(std::ilogb(at_least) - 23, at_most);
        g.least = at_least;
        return g;
    }

    /// A number of the code.
    explicit Grid(double literal) : least(std::fabs(literal)), most(std::fabs(literal)) {
        quantum = literal == 0 ? 1000 : std::ilogb(literal);
        while (std::remainder(literal, std::ldexp(1.0, quantum)) != 0) --quantum;
    }

    /// Veltkamp's constant for 24 digits.
    static Grid splitter() { return Grid(4097); }
};

/// How many operations were looked at since the last line, and how many failed.
int operations = 0;
int failures = 0;
/// Whether a line of the proof failed.
bool fails = false;

/// fl(x) of the x that the operation gives, rounded up by one part in 2^24.
inline Grid grid_result(int quantum, double least, double most) {
    Grid g(quantum, most * (1 + 0x1p-24));
    g.least = std::max(g.least, least * (1 - 0x1p-24));
    ++operations;
    failures += most > 0 && std::max(std::ldexp(1.0, quantum), least) < 0x1p-126;
    failures += g.most > static_cast<double>(std::numeric_limits<float>::max());
    return g;
}

inline Grid operator*(Grid a, Grid b) {
    return grid_result(a.quantum + b.quantum, a.least * b.least, a.most * b.most);
}
inline Grid operator+(Grid a, Grid b) {
    const int quantum = std::min(a.quantum, b.quantum);
    return grid_result(quantum, std::ldexp(1.0, quantum), a.most + b.most);
}
inline Grid operator-(Grid a, Grid b) { return a + b; }
inline Grid abs(Grid a) { return a; }

/// For project_axis, instead of the text: what the last three lemmas of project.g say.
inline Grid snap_projected(Grid x) {
    const Grid snapped = Grid(-63, 0x1p-37) - Grid(kProjectedSnap);
    return Grid(snapped.quantum, x.most + kProjectionSnap);
}

namespace {

/// Prints the line, and notes whether an operation failed.
void line(const char* what, const Grid& result, int quantum, double most) {
    const bool as_said =
        (result.quantum >= quantum || result.least * (1 + 0x1p-15) >= std::ldexp(1.0, quantum)) &&
        result.most <= most * (1 + 0x1p-15);
    std::printf("%-44s multiple of 2^%d, at least 2^%.2f, at most 2^%.2f: %d operations%s%s\n",
                what, result.quantum, std::log2(result.least), std::log2(result.most), operations,
                failures == 0 ? "" : ", FAILS", as_said ? "" : ", NOT AS SAID");
    fails = fails || failures > 0 || !as_said;
    operations = failures = 0;
}

const Grid kDirection(-46, 2);
const Grid kLargest = Grid::between(1, 2);  // d.z

void projections(int grid) {
    const Grid vertex(grid, kInvalidCoordinate);
    const Grid origin(grid, kOriginExtent);
    const Grid a = vertex - origin;
    line("a = vertex - org", a, -40, 0x1p41);
    line("difference_error", difference_error(vertex, origin, a), -40, 0x1p45);
    const Grid error(grid, a.most * kRounding);
    line("fast x", a * kLargest - kDirection * a, -86, 0x1p43);
    const Grid x = project_axis(a, error, a, error, kDirection, kLargest);
    line("compensated x", x, -63, 0x1p88);
}

/// Exact functions are multiples of 2^-126 by |x| <= 2^43 and project.g. Fast ones are beyond
/// their bound and so more than 2^-22 of their sum.
void depths(int grid) {
    const Grid x(-63, 0x1p44);
    line("exact edge function", difference_of_products(x, x, x, x), -126, 0x1p127);
    const Grid sum = Grid::between(0x1p-126, 0x1p91);
    // rcp(x) is 1 / x up to two ulp.
    const Grid scale = Grid::between((1 - 0x1p-22) / sum.most, (1 + 0x1p-22) / sum.least);
    // The last step of rcp: y e2, where e2 = fl(1 - x y), x y in [1/2, 2], is a multiple of 2^-24.
    line("scale = rcp(sum): y * e2", scale * Grid(-24, 0x1p-2), -116, 0x1p124);
    // scaled_weight: kept weights are more than 2^-61 of the sum.
    const Grid weight = Grid::between((1 - 0x1p-21) * 0x1p-61, 1 + 0x1p-21);
    line("wb, wc, and their sum", weight + weight, -85, 2 + 0x1p-20);
    // fl(wb + wc) is a multiple of 2^-24 from 1/2 on; below, the difference is at least 1/2.
    const Grid rest(-24, 1);
    const Grid z(grid, 0x1p41);
    const Grid mean = (rest * z + weight * z) + weight * z;
    line("z", mean, -125, 0x1p43);
    // z is certain: beyond kMeanRounding size, or more than a quarter of the least |z|.
    const Grid certain = Grid::between(0.5 * kMeanRounding * std::ldexp(1.0, grid), 0x1p43);
    line("t", certain * Grid::between(0.5, 1), -87, 0x1p43);
}

/// bound / sum >= 2^-21, because bound >= 2^-20 m^2, and three functions of two products each are
/// at most 3 (m / 2)^2 2. It is less than 1 where the functions are beyond their bound.
void bounds(int grid) {
    const Grid x(-86, 0x1p44);
    const Grid m = ((x + x) + (x + x)) + (x + x);
    line("m", m, -86, 0x1p47);
    const Grid z(grid, 0x1p41);
    const Grid part = Grid(kFastProjectionError) * ((m + m) + z);
    line("kFastProjectionError * (2 m + Z)", part, -126, 0x1p28);
    const Grid r = Grid::between(kFastProjectionFloor, part.most + 1);
    const Grid sum = Grid::between(r.least, m.most + 2 * r.most);  // m + 2 r >= r
    const Grid bound = r * sum;
    line("bound", bound, -98, 0x1p75);
    line("bound * range", bound * Grid::between(1, 0x1p42), -98, 0x1p117);
    const Grid part_of_sum = Grid::between(0x1p-21, 1);
    const Grid by_range = Grid(2) * part_of_sum + Grid(kWeightRounding);
    const Grid by_range_at_least = Grid::between(kWeightRounding, by_range.most);
    line("by_range * range", by_range_at_least * Grid(grid, 0x1p42), -83, 0x1p44);
    line("kMeanRounding * size", Grid(kMeanRounding) * z, -61, 0x1p20);
}

void slabs(int grid) {
    const Grid largest = Grid::between(kSceneExtent, kOriginExtent);
    const Grid origin(grid, kOriginExtent);
    const Grid coordinate(grid, kSceneExtent);
    const Grid extent = coordinate - coordinate;
    const Grid pad = Grid(kPadOfExtent) * extent + Grid(kPadOfPlane) * coordinate;
    line("plane - pad", coordinate - pad, -63, 0x1p21);
    const Grid dilation = Grid(kDilationOfOrigin) * origin + Grid(kDilationOfExtent) * largest;
    line("D", dilation, -64, 0x1p17);
    const Grid plane(-63, kEmptyPlane);
    const Grid difference = plane - (origin + dilation);
    line("plane - (org + D)", difference, -64, 0x1p49);
    // 1 / d for |d| in [2^-46, 2], and what stands for 1 / 0.
    const Grid reciprocal = Grid::between(0.5, kHugeReciprocal);
    const Grid times = difference * reciprocal;
    line("entry and exit", times, -65, 0x1p113);
    line("exit * kSlabRounding", times * Grid::between(1, 2), -65, 0x1p114);
}

}  // namespace
}  // namespace mray::proofs

// With "finer": whether a grid of coordinates half as wide would be too fine.
int main(int argc, char** argv) {
    using namespace mray::proofs;
    const bool is_finer = argc > 1 && std::string_view(argv[1]) == "finer";
    const int grid = is_finer ? -41 : -40;
    projections(grid);
    depths(grid);
    bounds(grid);
    slabs(grid);
    return fails == is_finer ? 0 : 1;
}
