#include "clips/keyframes/measure_positions.h"

#include <algorithm>
#include <cmath>

#include "clips/mesh/mesh_rules.h"

namespace mray {
namespace {

/// Floats of whole vertices that vectors of any width divide.
constexpr std::size_t kLanes = 48;

/// Bounds of coordinates lane by lane, in loops that compilers turn into vectors.
struct Lanes {
    float lower[kLanes];
    float upper[kLanes];
    /// Not 0 if a coordinate was bad.
    unsigned bad[kLanes] = {};

    explicit Lanes(vec3 first) {
        for (std::size_t i = 0; i < kLanes; ++i) lower[i] = upper[i] = first[int(i % 3)];
    }
    void add(const float* coordinates) {
        for (std::size_t i = 0; i < kLanes; ++i) {
            const float x = coordinates[i];
            lower[i] = x < lower[i] ? x : lower[i];
            upper[i] = x > upper[i] ? x : upper[i];
            // True for NaN, too.
            bad[i] |= !(std::abs(x) <= kMaxCoordinate);
        }
    }
};

std::optional<BadCoordinate> first_bad(std::span<const vec3> positions) {
    for (std::size_t i = 0; i < positions.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            if (!(std::abs(positions[i][axis]) <= kMaxCoordinate))
                return BadCoordinate{i, positions[i][axis]};
        }
    }
    return std::nullopt;
}

}  // namespace

PositionMeasures measure_positions(std::span<const vec3> positions) {
    static_assert(sizeof(vec3) == 3 * sizeof(float));
    constexpr std::size_t kBlock = kLanes / 3;
    if (positions.size() < kBlock) return {bounds_of(positions), first_bad(positions)};
    Lanes lanes(positions.front());
    const auto* const floats = reinterpret_cast<const float*>(positions.data());
    for (std::size_t i = 0; i + kBlock <= positions.size(); i += kBlock) lanes.add(floats + 3 * i);
    lanes.add(floats + 3 * (positions.size() - kBlock));
    if (std::any_of(std::begin(lanes.bad), std::end(lanes.bad), [](unsigned b) { return b != 0; }))
        return {bounds_of(positions), first_bad(positions)};
    PositionMeasures measures;
    for (std::size_t i = 0; i < kLanes; i += 3) {
        const double lower[3] = {lanes.lower[i], lanes.lower[i + 1], lanes.lower[i + 2]};
        const double upper[3] = {lanes.upper[i], lanes.upper[i + 1], lanes.upper[i + 2]};
        measures.bounds.extend(lower, upper);
    }
    return measures;
}

}  // namespace mray
