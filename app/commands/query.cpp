// morphray query: writes where the points of a file are, or which triangles cross.
#include "app/animation/animation_scene.h"
#include "app/animation/devices.h"
#include "app/animation/frames.h"
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
    const auto asks = [&](Question question) {
        return std::ranges::find(options.questions, question) != options.questions.end();
    };
    const bool asks_winding = asks(Question::kWinding);
    const bool asks_by_rule = asks(Question::kInside) || asks(Question::kDistance);
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
    for (const Question question : options.questions) {
        const auto add = [&](const auto& answers, const auto& text_of_answer) {
            for (std::size_t i = 0; i < count; ++i) {
                if (question != options.questions.front()) lines[i] += ' ';
                lines[i] += text_of_answer(answers[i]);
            }
        };
        if (question == Question::kInside) {
            std::vector<std::uint8_t> inside(count);
            scene.contains(points, inside, options.rule, cancellable);
            add(inside, [](std::uint8_t is_inside) { return is_inside != 0 ? '1' : '0'; });
        } else if (question == Question::kWinding) {
            std::vector<std::int32_t> windings(count);
            scene.winding(points, windings, cancellable);
            add(windings, [](std::int32_t winding) { return std::to_string(winding); });
        } else if (question == Question::kDistance) {
            std::vector<float> distances(count);
            scene.signed_distance(points, distances, options.rule, options.max_distance,
                                  cancellable);
            add(distances, [](float distance) { return fmt::format("{:.9g}", distance); });
        } else {
            std::vector<morphray::ClosestPoint> closest(count);
            scene.closest_points(points, closest, options.max_distance, cancellable);
            add(closest,
                [&](const morphray::ClosestPoint& point) { return text_of(point, origin); });
        }
    }
    for (const std::string& line : lines) text += line + '\n';
}

/// The lines of the pairs of triangles that cross, or of their numbers, at each frame.
ExitCode list_crossings(const Options& options, const Messages& messages) {
    const std::unique_ptr<Animation> animation = open_animation(options.source, messages);
    std::vector<double> frames = {animation->first_frame()};
    if (!options.frames.empty()) frames = select_frames(options, *animation, DefaultFrames::kAll);
    AnimationScene scene(open_device(options.backend, messages), options, *animation,
                         frames.front(), messages);
    const morphray::CrossingOptions all_or_none{
        .limit = options.counts_only ? 0 : std::numeric_limits<std::uint64_t>::max()};
    std::string text;
    Progress progress("querying", frames.size(), messages);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const double frame = frames[i];
        scene.advance(frame);
        const morphray::Crossings found = call_library(
            [&] { return scene.scene().crossings(all_or_none, {.cancel = &interrupt_flag()}); });
        if (options.counts_only) text += fmt::format("{} {}\n", frame, found.left_out);
        for (const auto& [first, second] : found.pairs)
            text += fmt::format("{} {} {} {} {}\n", frame, first.geom_id, first.prim_id,
                                second.geom_id, second.prim_id);
        progress.update(i + 1);
    }
    write_report(options.out, text);
    return ExitCode::kOk;
}

}  // namespace

ExitCode run_query(const Options& given, const Messages& messages) {
    check_reports({given.out});
    if (given.questions.front() == Question::kCrossings) return list_crossings(given, messages);
    Options options = given;
    if (!given.frames.empty()) {
        const std::vector<double> frames = parse_frame_range(given.frames);
        if (frames.size() > 1)
            throw Error(ErrorKind::kBadArgument, "--frames: points are asked about at one frame");
        options.frame = frames.front();
    }
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
