#include <algorithm>
#include <cmath>
#include <utility>

#include "scenes/procedural/helpers.h"
#include "scenes/procedural/procedural.h"
#include "scenes/trig.h"

namespace mray {
namespace {

constexpr double kRadiansPerTurn = 6.283185307179586476925;

constexpr double kBallRadius = 1;
// The sheet bends around this, a little more than the ball.
constexpr double kDrapeRadius = 1.03;
constexpr double kSheetHalfSide = 1.7;
constexpr double kGroundHalfSide = 2.4;
constexpr double kCheckers = 8;

// The sheet never gets steeper than this: almost a quarter turn.
constexpr double kSteepestTurns = 0.24;

struct Pose {
    double frame;
    double bend;
    double lift;
    double fold_height;
    double wave_height;
    CosSin wide_fold_phase;
    CosSin narrow_fold_phase;
};

Pose pose_at(double frame) {
    const double settled = smooth_step(2, 14, frame);
    return {.frame = frame,
            .bend = (0.13 + 0.87 * settled) / kDrapeRadius,
            .lift = 0.6 * (1 - smooth_step(0, 10, frame)),
            .fold_height = 0.36 * settled,
            .wave_height = 0.16 - 0.1 * settled,
            .wide_fold_phase = circle_point(frame / 24),
            .narrow_fold_phase = circle_point(-frame / 12)};
}

// cos(count * angle + phase).
double wave_around(CosSin angle, int count, CosSin phase) {
    CosSin sum = phase;
    for (int i = 0; i < count; ++i) {
        sum = {sum.cos * angle.cos - sum.sin * angle.sin,
               sum.sin * angle.cos + sum.cos * angle.sin};
    }
    return sum.cos;
}

// The sheet as a bent disc: a point at distance r from the middle goes along an arc of curvature
// pose.bend, then straight down at the steepest angle. Folds and waves stand out from that to the
// outer side only, so the ball stays inside: an arc that touches a smaller circle from outside and
// is less curved encloses it.
glm::dvec3 sheet_point(const Pose& pose, double x, double z) {
    const double r = std::sqrt(x * x + z * z);
    const CosSin angle = r > 0 ? CosSin{x / r, z / r} : CosSin{1, 0};

    const double on_arc = std::min(r, kSteepestTurns * kRadiansPerTurn / pose.bend);
    const double slope_turns = on_arc * pose.bend / kRadiansPerTurn;
    const CosSin slope = circle_point(slope_turns);
    const double straight = r - on_arc;
    const double out = slope.sin / pose.bend + straight * slope.cos;
    const double down = (1 - slope.cos) / pose.bend + straight * slope.sin;

    const double folds = 0.5 + 0.33 * wave_around(angle, 7, pose.wide_fold_phase) +
                         0.17 * wave_around(angle, 11, pose.narrow_fold_phase);
    const double waves = 0.5 + 0.3 * sin_turns(0.45 * x + 0.25 * z - pose.frame / 8) +
                         0.2 * sin_turns(0.7 * z - 0.3 * x - pose.frame / 12);
    const double height =
        pose.fold_height * smooth_step(0.4, 2.2, r) * folds + pose.wave_height * waves;

    const double rim = out + height * slope.sin;
    const double y = kBallRadius + kDrapeRadius + pose.lift - down + height * slope.cos;
    return {rim * angle.cos, y, rim * angle.sin};
}

// -1 to 1 over the grid's rows or columns.
double across(std::uint32_t index, std::uint32_t count) { return 2.0 * index / count - 1; }

GridColour checkers(const Grid& grid, Albedo light, Albedo dark) {
    return [grid, light, dark](std::uint32_t row, std::uint32_t column) {
        const auto tile = [](std::uint32_t index, std::uint32_t count) {
            return static_cast<std::uint32_t>(kCheckers * (index + 0.5) / count);
        };
        return (tile(row, grid.rows) + tile(column, grid.columns)) % 2 == 0 ? light : dark;
    };
}

}  // namespace

DeformingMesh make_cloth(std::uint64_t triangles) {
    const Sheet ground(triangles / 10);
    const Sphere ball(triangles / 5);
    const std::uint64_t rest = ground.triangle_count() + ball.triangle_count();
    const Sheet sheet(triangles > rest ? triangles - rest : 0);

    DeformingMesh mesh;
    ground.append_to(mesh.topology, checkers(ground.grid(), rgb(104, 110, 118), rgb(66, 72, 82)));
    ball.append_to(mesh.topology, [](auto, auto) { return rgb(24, 110, 150); });
    sheet.append_to(mesh.topology, checkers(sheet.grid(), rgb(214, 184, 138), rgb(164, 30, 24)));

    mesh.move = [ground, ball, sheet](double frame, VertexRange range, std::span<vec3> out) {
        const Pose pose = pose_at(frame);
        const std::uint32_t ball_begin = ground.vertex_count();
        const std::uint32_t sheet_begin = ball_begin + ball.vertex_count();
        const auto on_sheet = [](const Grid& grid, std::uint32_t vertex) {
            return std::pair{across(vertex % (grid.columns + 1), grid.columns),
                             across(vertex / (grid.columns + 1), grid.rows)};
        };
        for (std::uint32_t i = range.begin; i < range.end; ++i) {
            if (i < ball_begin) {
                const auto [x, z] = on_sheet(ground.grid(), i);
                out[i] = round_to_float({kGroundHalfSide * x, 0, kGroundHalfSide * z});
            } else if (i < sheet_begin) {
                out[i] = round_to_float(glm::dvec3(0, kBallRadius, 0) +
                                        kBallRadius * ball.direction(i - ball_begin));
            } else {
                const auto [x, z] = on_sheet(sheet.grid(), i - sheet_begin);
                out[i] = round_to_float(sheet_point(pose, kSheetHalfSide * x, kSheetHalfSide * z));
            }
        }
    };
    return mesh;
}

}  // namespace mray
