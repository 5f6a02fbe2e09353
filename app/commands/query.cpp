// morphray query: reads points from a file and writes where they are to a file.
#include "app/animation/animation_scene.h"
#include "app/base/ray_reader.h"
#include "app/commands/commands.h"

namespace mray::app {
namespace {

constexpr Choice<morphray::Feature> kFeatures[] = {{"face", morphray::Feature::face},
                                                   {"edge", morphray::Feature::edge},
                                                   {"vertex", morphray::Feature::vertex}};

std::string text_of(const morphray::ClosestPoint& c, const Origin& origin) {
    if (!c) return "- - - inf - - - -";
    const glm::dvec3 p = origin.from_world({c.point.x, c.point.y, c.point.z});
    return fmt::format("{1:.{0}g} {2:.{0}g} {3:.{0}g} {4:.9g} {5} {6:.9g} {7:.9g} {8}",
                       origin.digits(), p.x, p.y, p.z, c.distance, c.prim_id, c.u, c.v,
                       name_in(kFeatures, c.feature));
}

/// Warns if queries that need a closed mesh are about one that is not, or encloses nothing.
void warn_if_open(const Options& options, const PosedAnimation& posed, const Messages& messages) {
    const auto asks = [&](PointQuery query) {
        return std::ranges::find(options.queries, query) != options.queries.end();
    };
    const bool asks_winding = asks(PointQuery::kWinding);
    const bool asks_by_rule = asks(PointQuery::kInside) || asks(PointQuery::kDistance);
    if (!asks_winding && !asks_by_rule) return;
    const morphray::EdgeCounts edges = posed.scene->scene().edge_counts();
    const bool is_closed =
        edges.is_closed(asks_winding ? morphray::FillRule::nonzero : options.rule);
    if (is_closed && edges.twins == 0) return;
    const bool odd_helps = asks_by_rule && options.rule == morphray::FillRule::nonzero &&
                           edges.is_closed(morphray::FillRule::odd) && edges.twins == 0;
    messages.warn(
        {escape(posed.animation->name()),
         fmt::format("edges: {}; inside, winding and signs of distances need a closed "
                     "mesh{}{}",
                     describe(EdgeCounts{edges.open, edges.shared, edges.turned, edges.uneven,
                                         edges.twins}),
                     edges.twins != 0 ? " without twins" : "",
                     odd_helps ? "; --rule odd is right where triangles are only turned" : "")});
}

/// Appends a line of answers for each point.
void answer(const Options& options, const PosedAnimation& posed,
            std::span<const glm::dvec3> file_points, std::string& text) {
    const Origin origin = posed.animation->origin();
    const morphray::Scene& scene = posed.scene->scene();
    const std::size_t count = file_points.size();
    std::vector<morphray::Vec3> points;
    for (const glm::dvec3& point : file_points) {
        const vec3 p = origin.to_world(point);
        points.push_back({p.x, p.y, p.z});
    }
    const morphray::QueryOptions cancellable{.cancel = &interrupt_flag()};
    std::vector<std::string> lines(count);
    for (const PointQuery query : options.queries) {
        const auto add = [&](auto answers, const auto& ask, const auto& text_of_answer) {
            ask(std::span(answers));
            for (std::size_t i = 0; i < count; ++i) {
                if (query != options.queries.front()) lines[i] += ' ';
                lines[i] += text_of_answer(answers[i]);
            }
        };
        if (query == PointQuery::kInside)
            add(
                std::vector<std::uint8_t>(count),
                [&](auto inside) { scene.contains(points, inside, options.rule, cancellable); },
                [](std::uint8_t is_inside) { return is_inside != 0 ? '1' : '0'; });
        if (query == PointQuery::kWinding)
            add(
                std::vector<std::int32_t>(count),
                [&](auto windings) { scene.winding(points, windings, cancellable); },
                [](std::int32_t winding) { return std::to_string(winding); });
        if (query == PointQuery::kDistance)
            add(
                std::vector<float>(count),
                [&](auto distances) {
                    scene.signed_distance(points, distances, options.rule, options.max_distance,
                                          cancellable);
                },
                [](float distance) { return fmt::format("{:.9g}", distance); });
        if (query == PointQuery::kClosest)
            add(
                std::vector<morphray::ClosestPoint>(count),
                [&](auto closest) {
                    scene.closest_points(points, closest, options.max_distance, cancellable);
                },
                [&](const morphray::ClosestPoint& point) { return text_of(point, origin); });
    }
    for (const std::string& line : lines) text += line + '\n';
}

}  // namespace

ExitCode run_query(const Options& options, const Messages& messages) {
    check_reports({options.out});
    const std::vector<glm::dvec3> points = read_points(options.point_file);
    const PosedAnimation posed = pose_animation(options, messages);
    call_library([&] { warn_if_open(options, posed, messages); });
    std::string text;
    in_batches("querying", points.size(), messages, [&](std::size_t first, std::size_t count) {
        call_library(
            [&] { answer(options, posed, std::span(points).subspan(first, count), text); });
    });
    const auto finite = static_cast<std::size_t>(
        std::ranges::count_if(points, [](const auto& p) { return all_finite(p); }));
    if (finite < points.size())
        messages.warn({escape(input_name(options.point_file)),
                       fmt::format("{} of {} points are not finite; they are outside and have no "
                                   "closest point",
                                   points.size() - finite, points.size())});
    write_report(options.out, text);
    return ExitCode::kOk;
}

}  // namespace mray::app
