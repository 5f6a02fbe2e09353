// morphray query: reads points from a file and writes where they are to a file.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/base/library_calls.h"
#include "app/clip/posed_scene.h"
#include "app/commands/commands.h"
#include "app/files/ray_reader.h"
#include "app/report/answers.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/progress.h"
#include "common/text/text_parts.h"

namespace mray::app {
namespace {

// Points that are asked about and written together.
constexpr std::size_t kPointsOfBatch = std::size_t{1} << 16;

bool is_finite(const morphray::Vec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

/// Asks about points in batches and gathers the answers.
class PointAsker {
public:
    PointAsker(const QueryOptions& options, const morphray::Scene& scene)
        : options_(options), scene_(scene), answers_(options.format, options.questions) {}

    void add(const morphray::Vec3& point) {
        if (!is_finite(point)) ++invalid_;
        points_.push_back(point);
        if (points_.size() == kPointsOfBatch) flush();
    }

    void flush() {
        throw_if_interrupted();
        call_library([&] {
            for (const Question question : options_.questions) ask(question);
        });
        answers_.add(points_, batch_);
        points_.clear();
    }

    const PointAnswers& answers() const { return answers_; }
    std::uint64_t invalid() const { return invalid_; }

private:
    void ask(Question question) {
        const std::size_t count = points_.size();
        switch (question) {
            case Question::kInside:
                batch_.inside.resize(count);
                scene_.contains(points_, batch_.inside, options_.rule, &interrupt_flag());
                break;
            case Question::kWinding:
                batch_.windings.resize(count);
                scene_.winding(points_, batch_.windings, &interrupt_flag());
                break;
            case Question::kDistance:
                batch_.distances.resize(count);
                scene_.signed_distance(points_, batch_.distances, options_.rule,
                                       options_.max_distance, &interrupt_flag());
                break;
            case Question::kClosest:
                batch_.closest.resize(count);
                scene_.closest_points(points_, batch_.closest, options_.max_distance,
                                      &interrupt_flag());
                break;
        }
    }

    const QueryOptions& options_;
    const morphray::Scene& scene_;
    std::vector<morphray::Vec3> points_;
    AnswerBatch batch_;
    PointAnswers answers_;
    std::uint64_t invalid_ = 0;
};

}  // namespace

ExitCode run_query(const QueryOptions& options, const Messages& messages) {
    check_reports({options.out});
    const std::string text = read_input(options.point_file, "points");
    const PosedScene scene(options.source, options.backend, options.frame, messages);
    const std::string name = input_name(options.point_file);
    PointReader reader(name, text);
    PointAsker asker(options, scene.scene());
    const PointAnswers& answers = asker.answers();
    Progress progress("asking", reader.total(), messages);
    std::uint64_t answered = 0;
    for (morphray::Vec3 point; reader.next(point);) {
        asker.add(point);
        if (answers.point_count() == answered) continue;
        answered = answers.point_count();
        progress.update(reader.position());
    }
    asker.flush();
    if (asker.invalid() > 0) {
        messages.warn({escape(name), fmt::format("{} of {} points are not finite; they are outside "
                                                 "and have no closest point",
                                                 asker.invalid(), answers.point_count())});
    }
    const Topology& topology = scene.topology();
    const ReportHead head{"query", scene.name(), topology.triangles.size(), topology.vertex_count};
    write_report(options.out, answers.file(head, scene.frame(), options.rule));
    return ExitCode::kOk;
}

}  // namespace mray::app
