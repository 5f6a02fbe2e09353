#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <span>

#include "common/interop/surface.h"
#include "cpu/image/image_tracer.h"
#include "cpu/packet/packet_tracer.h"
#include "cpu/single_ray/single_ray_tracer.h"
#include "lab/accuracy/charts/charts.h"
#include "lab/accuracy/measure/measure.h"

namespace mray::accuracy {
namespace {

constexpr double kAngles[] = {0, 2, 5, 10, 15, 20, 30, 45, 60, 75, 90};
constexpr std::uint32_t kSide = 256;
// Rays a point in ambient occlusion of an image, where many points lie side by side.
constexpr std::size_t kFew = 16;
// Rays of a square packet.
constexpr std::size_t kMany = cpu::kSquareRays;

/// The rays of several points, point by point.
struct Cones {
    std::size_t shared_origin_rays;
    std::vector<Ray> rays;
    /// The same rays in the layout of packets.
    std::vector<cpu::SharedOriginRays> blocks;
};

/// The surfaces that the camera sees, in the order of its tiles.
std::vector<Surface> seen_surfaces(const ChartScene& scene, const cpu::SingleRayTracer& tracer) {
    const std::vector<Ray>& rays = scene.scene_space.camera_rays;
    const std::vector<vec3>& positions = scene.scene_space.positions;
    std::vector<Hit> hits(rays.size());
    tracer.intersect(rays, hits);
    std::vector<Surface> surfaces;
    for (std::size_t i = 0; i < hits.size(); ++i) {
        if (hits[i].prim_id == kNoPrim) continue;
        const uvec3 t = scene.topology.triangles[hits[i].prim_id];
        surfaces.push_back(
            surface_at(rays[i], hits[i], positions[t.x], positions[t.y], positions[t.z]));
    }
    return surfaces;
}

/// A direction at the angle `radius` * `largest` from the normal, turned by `turn` around it.
Ray cone_ray(const Surface& surface, double largest, double radius, double turn, float tfar) {
    const vec3 n = surface.normal;
    // Two directions across (T. Duff et al. Building an Orthonormal Basis, Revisited. 2017).
    const double sign = n.z < 0 ? -1 : 1;
    const double a = -1 / (sign + n.z);
    const double b = a * n.x * n.y;
    const std::array<double, 3> x{1 + sign * a * n.x * n.x, sign * b, -sign * n.x};
    const std::array<double, 3> y{b, sign + a * n.y * n.y, -n.y};
    const double sine = std::sin(radius * largest);
    vec3 dir;
    for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<std::size_t>(axis);
        dir[axis] = static_cast<float>(std::cos(radius * largest) * n[axis] +
                                       sine * (std::cos(turn) * x[i] + std::sin(turn) * y[i]));
    }
    return {off_surface(surface, surface.size), 0, canonical_direction(dir),
            tfar * power_of_two_below(largest_component(dir))};
}

/// Rays from `count` points, spread over the surfaces or side by side, in cells of a square that is
/// mapped to a disc (P. Shirley, K. Chiu. A low distortion map between disk and
/// square. 1997), so that neighbours in a packet are neighbours in the cone.
Cones make_cones(std::span<const Surface> surfaces, std::size_t count,
                 std::size_t shared_origin_rays, double degrees, float tfar) {
    Cones cones{shared_origin_rays, {}, {}};
    if (surfaces.empty()) return cones;
    const auto side = static_cast<std::uint32_t>(std::lround(std::sqrt(shared_origin_rays)));
    const double largest = degrees * std::numbers::pi / 180;
    std::mt19937_64 random(5);
    const auto unit = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
    cones.rays.resize(count * shared_origin_rays);
    for (std::size_t point = 0; point < count; ++point) {
        const Surface& surface =
            surfaces[shared_origin_rays == kMany ? point * surfaces.size() / count
                                                 : point % surfaces.size()];
        for (std::uint32_t y = 0; y < side; ++y) {
            for (std::uint32_t x = 0; x < side; ++x) {
                const double u = 2 * (x + unit()) / side - 1;
                const double v = 2 * (y + unit()) / side - 1;
                const bool wide = std::abs(u) > std::abs(v);
                const double radius = wide ? u : v;
                const double turn = wide ? std::numbers::pi / 4 * v / u
                                         : std::numbers::pi / 4 * (2 - u / (v == 0 ? 1 : v));
                const std::size_t ray = shared_origin_rays == kMany ? cpu::light_packet_ray(x, y)
                                                                    : std::size_t{y} * side + x;
                cones.rays[point * shared_origin_rays + ray] =
                    cone_ray(surface, largest, radius, turn, tfar);
            }
        }
    }
    cones.blocks.resize(cones.rays.size() / cpu::kBlockRays);
    for (std::size_t i = 0; i < cones.rays.size(); ++i)
        cones.blocks[i / cpu::kBlockRays].set(i % cpu::kBlockRays, cones.rays[i]);
    return cones;
}

/// Counts over all rays.
struct Answers {
    std::atomic<std::size_t> occluded{0};
    std::atomic<std::size_t> undecided{0};
};

/// Calls answer(rays, occluded, answers) for batches of rays and counts the occluded ones.
template <class Answer>
void for_each_packet(const Cones& cones, Answers& answers, Answer answer) {
    answers.occluded = answers.undecided = 0;
    tbb::parallel_for(std::size_t{0}, cones.rays.size() / kMany, [&](std::size_t i) {
        std::array<std::uint8_t, kMany> occluded;
        answer(std::span(cones.rays).subspan(i * kMany, kMany), std::span(occluded), answers);
        answers.occluded +=
            static_cast<std::size_t>(std::count(occluded.begin(), occluded.end(), std::uint8_t{1}));
    });
}

void trace_one_by_one(const Cones& cones, const cpu::SingleRayTracer& tracer, Answers& answers) {
    for_each_packet(cones, answers, [&](auto rays, auto occluded, Answers&) {
        for (std::size_t i = 0; i < rays.size(); ++i)
            tracer.occluded(rays.subspan(i, 1), occluded.subspan(i, 1));
    });
}

void trace_streams(const Cones& cones, const cpu::SingleRayTracer& tracer, Answers& answers) {
    for_each_packet(cones, answers,
                    [&](auto rays, auto occluded, Answers&) { tracer.occluded(rays, occluded); });
}

/// Traces each point's rays as a packet and its fallback rays as streams, as the program does with
/// shadow rays.
void trace_packets(const Cones& cones, const cpu::PacketTracer& tracer,
                   const cpu::SingleRayTracer& others, Answers& answers) {
    for_each_packet(cones, answers, [&](auto rays, auto occluded, Answers& counts) {
        thread_local const auto packet = std::make_unique<cpu::LightPacket>();
        std::array<std::uint16_t, cpu::kSquareRays> undecided;
        const auto first = static_cast<std::size_t>(&rays[0] - cones.rays.data());
        const auto blocks =
            std::span(cones.blocks).subspan(first / cpu::kBlockRays, kMany / cpu::kBlockRays);
        const std::size_t count = tracer.occluded_shared_origin(rays[0].org, blocks, *packet,
                                                                occluded.data(), undecided.data());
        counts.undecided += count;
        cpu::occluded_among(others, rays[0].org, blocks, std::span(undecided).first(count),
                            occluded);
    });
}

constexpr const char* kWays[] = {"packets (1024 rays a point)", "streams (1024 rays a point)",
                                 "one by one (1024 rays a point)", "streams (16 rays a point)",
                                 "one by one (16 rays a point)"};

}  // namespace

std::size_t cone_steps() { return std::size(kAngles); }

Chart cone_chart(const ChartContext& context, const ChartInput& input, const std::string& suffix) {
    const ChartScene scene =
        make_chart_scene(input.name, input.topology, input.positions, {}, kSide, 0);
    const SimdTarget target = supported_simd_targets().front();
    const cpu::SingleRayTracer wide(scene.scene_space.bvh, target);
    const cpu::PacketTracer packets(scene.scene_space.bvh, target);
    const std::vector<Surface> surfaces = seen_surfaces(scene, wide);
    const std::size_t points = context.effort.cone_points;
    Table table({"way", "degrees", "Mray/s", "occluded %", "undecided %"});
    std::vector<std::vector<std::vector<std::string>>> rows(std::size(kWays));
    for (const double degrees : kAngles) {
        const Cones many = make_cones(surfaces, points, kMany, degrees, scene.params.ao_tfar);
        const Cones few =
            make_cones(surfaces, points * kMany / kFew, kFew, degrees, scene.params.ao_tfar);
        std::array<Answers, std::size(kWays)> answers;
        const std::vector<std::function<void()>> runs{
            [&] { trace_packets(many, packets, wide, answers[0]); },
            [&] { trace_streams(many, wide, answers[1]); },
            [&] { trace_one_by_one(many, wide, answers[2]); },
            [&] { trace_streams(few, wide, answers[3]); },
            [&] { trace_one_by_one(few, wide, answers[4]); }};
        const std::vector<double> times = least_times(runs, context.effort.rounds, context.check);
        const auto count = static_cast<double>(std::max<std::size_t>(1, many.rays.size()));
        for (std::size_t i = 0; i < runs.size(); ++i) {
            rows[i].push_back(
                {kWays[i], fmt::format("{}", degrees),
                 fmt::format("{:.4g}", count / (times[i] * 1e3)),
                 fmt::format("{:.1f}", 100 * static_cast<double>(answers[i].occluded) / count),
                 fmt::format("{:.1f}", 100 * static_cast<double>(answers[i].undecided) / count)});
        }
        context.step();
    }
    // The points of a line must be adjacent.
    for (const auto& of_way : rows) {
        for (const std::vector<std::string>& row : of_way) table.add(row);
    }

    const plot::Figure figure{
        .title = fmt::format("Where coherence ends: rays in a cone, {}, {} triangles, {}",
                             input.name, input.topology.triangles.size(), target.name),
        .footer = context.footer,
        .panels = {{.kind = "lines",
                    .x = "degrees",
                    .y = "\"Mray/s\"",
                    .series = "way",
                    .xlabel = "half the angle of the cone about the normal, degrees",
                    .ylabel = speed_title("any-hit rays")}}};
    return {
        "cones" + suffix,
        "Rays of ambient occlusion, on all threads. Packets need rays from one point; they are "
        "faster to the left of the crossing with the line of the streams, which take any 64 "
        "rays. In images there are few rays from each of many points side by side: the last two.",
        table, figure};
}

}  // namespace mray::accuracy
