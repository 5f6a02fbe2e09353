// morphray query: reads points from a file and writes where they are to a file.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "app/animation/animation_scene.h"
#include "app/base/messages.h"
#include "app/base/ray_reader.h"
#include "app/commands/commands.h"
#include "common/scene/mesh.h"
#include "common/text/text.h"

namespace mray::app {
namespace {

// Points that are answered and written together.
constexpr std::size_t kPointsOfBatch = std::size_t{1} << 16;

bool is_finite(const glm::dvec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

const char* name_of(morphray::Feature feature) {
    if (feature == morphray::Feature::vertex) return "vertex";
    return feature == morphray::Feature::edge ? "edge" : "face";
}

std::string text_of(const morphray::ClosestPoint& c, const Origin& origin) {
    if (!c) return "- - - inf - - - -";
    const glm::dvec3 p = origin.from_world({c.point.x, c.point.y, c.point.z});
    return fmt::format("{1:.{0}g} {2:.{0}g} {3:.{0}g} {4:.9g} {5} {6:.9g} {7:.9g} {8}",
                       origin.digits(), p.x, p.y, p.z, c.distance, c.prim_id, c.u, c.v,
                       name_of(c.feature));
}

/// Warns if queries that need a closed mesh are about one that is not, or encloses nothing.
void warn_if_open(const QueryOptions& options, const PosedAnimation& posed,
                  const Messages& messages) {
    const bool needs_closed = std::ranges::any_of(
        options.queries, [](PointQuery query) { return query != PointQuery::kClosest; });
    if (!needs_closed) return;
    const morphray::EdgeCounts edges = posed.scene->scene().edge_counts();
    if (edges.is_closed() && edges.twins == 0) return;
    messages.warn({escape(posed.animation->name()),
                   fmt::format("edges: {}; inside, winding and signs of distances need a closed "
                               "mesh{}",
                               describe(EdgeCounts{edges.open, edges.shared, edges.turned,
                                                   edges.uneven, edges.twins}),
                               edges.twins != 0 ? " without twins" : "")});
}

/// Answers queries about points in batches and gathers the answers as lines.
class PointQueries {
public:
    PointQueries(const QueryOptions& options, const PosedAnimation& posed)
        : options_(options), scene_(posed.scene->scene()), origin_(posed.animation->origin()) {}

    void answer(std::span<const glm::dvec3> points) {
        points_.clear();
        for (const glm::dvec3& point : points) {
            const vec3 p = origin_.to_world(point);
            points_.push_back({p.x, p.y, p.z});
        }
        call_library([&] {
            for (const PointQuery query : options_.queries) answer(query, points_);
        });
        for (std::size_t i = 0; i < points.size(); ++i) write(i);
    }

    const std::string& text() const { return text_; }

private:
    void answer(PointQuery query, std::span<const morphray::Vec3> points) {
        const std::size_t count = points.size();
        const morphray::QueryOptions options{.cancel = &interrupt_flag()};
        switch (query) {
            case PointQuery::kInside:
                inside_.resize(count);
                scene_.contains(points, inside_, options_.rule, options);
                break;
            case PointQuery::kWinding:
                windings_.resize(count);
                scene_.winding(points, windings_, options);
                break;
            case PointQuery::kDistance:
                distances_.resize(count);
                scene_.signed_distance(points, distances_, options_.rule, options_.max_distance,
                                       options);
                break;
            case PointQuery::kClosest:
                closest_.resize(count);
                scene_.closest_points(points, closest_, options_.max_distance, options);
                break;
        }
    }

    void write(std::size_t i) {
        const auto out = std::back_inserter(text_);
        for (const PointQuery query : options_.queries) {
            if (query != options_.queries.front()) text_ += ' ';
            if (query == PointQuery::kInside) fmt::format_to(out, "{}", inside_[i]);
            if (query == PointQuery::kWinding) fmt::format_to(out, "{}", windings_[i]);
            if (query == PointQuery::kDistance) fmt::format_to(out, "{:.9g}", distances_[i]);
            if (query == PointQuery::kClosest) text_ += text_of(closest_[i], origin_);
        }
        text_ += '\n';
    }

    const QueryOptions& options_;
    const morphray::Scene& scene_;
    const Origin origin_;
    std::vector<morphray::Vec3> points_;
    // The answers of a batch; those that are not asked for are empty.
    std::vector<std::uint8_t> inside_;
    std::vector<std::int32_t> windings_;
    std::vector<float> distances_;
    std::vector<morphray::ClosestPoint> closest_;
    std::string text_;
};

}  // namespace

ExitCode run_command(const QueryOptions& options, const Messages& messages) {
    check_reports({options.out});
    const std::vector<glm::dvec3> points = read_points(options.point_file);
    const PosedAnimation posed =
        pose_animation(options.source, options.backend, options.frame, messages);
    call_library([&] { warn_if_open(options, posed, messages); });
    PointQueries queries(options, posed);
    {
        Progress progress("querying", points.size(), messages);
        for (std::size_t done = 0; done < points.size(); done += kPointsOfBatch) {
            throw_if_interrupted();
            progress.update(done);
            queries.answer(
                std::span(points).subspan(done, std::min(kPointsOfBatch, points.size() - done)));
        }
    }
    const auto finite = static_cast<std::size_t>(std::ranges::count_if(points, is_finite));
    if (finite < points.size()) {
        messages.warn({escape(input_name(options.point_file)),
                       fmt::format("{} of {} points are not finite; they are outside and have no "
                                   "closest point",
                                   points.size() - finite, points.size())});
    }
    write_report(options.out, queries.text());
    return ExitCode::kOk;
}

}  // namespace mray::app
