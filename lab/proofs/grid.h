// Arithmetic on what is known of a float: 0, or a multiple of a power of two within a range. Each
// operation asks whether its result may be a denormal or overflow.
#ifndef PROOFS_GRID_H
#define PROOFS_GRID_H

#include <algorithm>
#include <cmath>
#include <limits>

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

/// How many operations were looked at since the program began, and how many failed.
struct GridCount {
    int operations = 0;
    int denormal = 0;
    int overflow = 0;
};

inline GridCount& grid_count() {
    static GridCount count;
    return count;
}

/// fl(x) of the x that the operation gives, rounded up by one part in 2^24.
inline Grid grid_result(int quantum, double least, double most) {
    Grid g(quantum, most * (1 + 0x1p-24));
    g.least = std::max(g.least, least * (1 - 0x1p-24));
    ++grid_count().operations;
    grid_count().denormal += most > 0 && std::max(std::ldexp(1.0, quantum), least) < 0x1p-126;
    grid_count().overflow += g.most > static_cast<double>(std::numeric_limits<float>::max());
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

}  // namespace mray::proofs

#endif  // PROOFS_GRID_H
