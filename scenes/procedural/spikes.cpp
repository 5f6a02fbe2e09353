#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <glm/geometric.hpp>

#include "scenes/procedural/helpers.h"
#include "scenes/procedural/procedural.h"
#include "scenes/trig.h"

namespace mray {
namespace {

constexpr std::uint32_t kSpikeCount = 48;
constexpr double kShortest = 0.2;
constexpr double kGrowth = 0.8;
constexpr double kPulseFrames = 8;
// Chord from a spike's axis to its foot on the unit sphere: half the distance of its neighbours.
constexpr double kFootRadius = 0.27;

// Spread evenly: a Fibonacci lattice, each direction a golden section of a turn from the last.
std::array<glm::dvec3, kSpikeCount> spike_directions() {
    constexpr double kGoldenTurn = 0.38196601125010515;
    std::array<glm::dvec3, kSpikeCount> directions;
    for (std::uint32_t i = 0; i < kSpikeCount; ++i) {
        const double y = 1 - (2 * i + 1.0) / kSpikeCount;
        const CosSin around = circle_point(kGoldenTurn * i);
        const double ring = std::sqrt(1 - y * y);
        directions[i] = {ring * around.cos, y, ring * around.sin};
    }
    return directions;
}

// The spike that a direction belongs to, and its height there: 1 on its axis, 0 from its foot on.
struct Slope {
    std::uint32_t spike;
    float height;
};

Slope slope_at(const std::array<glm::dvec3, kSpikeCount>& spikes, const glm::dvec3& direction) {
    std::uint32_t nearest = 0;
    double cosine = -1;
    for (std::uint32_t i = 0; i < kSpikeCount; ++i) {
        const double c = glm::dot(spikes[i], direction);
        if (c > cosine) {
            cosine = c;
            nearest = i;
        }
    }
    const double chord = std::sqrt(std::max(0.0, 2 - 2 * cosine));
    const double rise = std::max(0.0, 1 - chord / kFootRadius);
    return {nearest, static_cast<float>(rise * rise)};
}

}  // namespace

DeformingMesh make_spikes(std::uint64_t triangles) {
    const Sphere sphere(triangles);
    const auto spikes = spike_directions();
    std::vector<Slope> slopes;
    slopes.reserve(sphere.vertex_count());
    for (std::uint32_t i = 0; i < sphere.vertex_count(); ++i) {
        slopes.push_back(slope_at(spikes, sphere.direction(i)));
    }

    DeformingMesh mesh;
    sphere.append_to(mesh.topology, [&](std::uint32_t row, std::uint32_t column) {
        const std::uint32_t vertex = row == 0 ? 0 : 1 + (row - 1) * sphere.grid().columns + column;
        const Slope& slope = slopes[vertex];
        return slope.height > 0.02f ? palette(slope.spike) : rgb(150, 144, 130);
    });
    // The radius is a positive function of the direction, so the ball is star-shaped.
    mesh.move = [sphere, slopes = std::move(slopes)](double frame, VertexRange range,
                                                     std::span<vec3> out) {
        std::array<double, kSpikeCount> length;
        for (std::uint32_t i = 0; i < kSpikeCount; ++i) {
            const double pulse = 0.5 + 0.5 * cos_turns(frame / kPulseFrames + 0.37 * i);
            length[i] = kShortest + kGrowth * pulse;
        }
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            const double height = slopes[i].height;
            out[i] = round_to_float((1 + length[slopes[i].spike] * height) * sphere.direction(i));
        }
    };
    return mesh;
}

}  // namespace mray
