#include "app/report/reports.h"

#include <algorithm>
#include <numeric>

namespace mray::app {

FrameReport report_frame(Session& session, double frame_number, const Frame& frame,
                         bool with_tree) {
    FrameReport report;
    report.frame = frame_number;
    report.backend = session.tracer().name();
    report.update = name_of(session.last_update().step);
    report.reason = session.last_update().reason;
    report.cost_ratio = session.last_update().cost_ratio;
    report.refit_on = session.refitted_on();
    report.times = session.times();
    report.hits_hash = hits_hash(frame);
    report.image_hash = image_hash(frame);
    if (with_tree) {
        const Bvh& tree = session.tree();
        report.bvh_hash = bvh_hash(tree);
        report.sah_cost = bvh_stats(tree).sah_cost;
    }
    report.hits = count_hits(frame);
    report.misses = frame.hits.size() - report.hits;
    report.occluded =
        std::accumulate(frame.occlusion.begin(), frame.occlusion.end(), std::uint64_t{0});
    return report;
}

std::string CheckRow::variant() const {
    return backend + (simd.empty() ? "" : " " + simd) +
           (update == "refit" ? ", refit on " + refit_on : ", rebuild");
}

void compare(const Frame& expected, const Frame& actual, CheckRow& row) {
    row.difference = compare_frames(expected, actual);
    row.expected_hits_hash = hits_hash(expected);
    row.hits_hash = hits_hash(actual);
    row.expected_image_hash = image_hash(expected);
    row.image_hash = image_hash(actual);
}

bool CheckReport::equal() const {
    return std::all_of(rows.begin(), rows.end(), [](const CheckRow& row) { return row.equal(); }) &&
           std::all_of(trees.begin(), trees.end(), [](const TreeRow& row) { return row.equal(); });
}

}  // namespace mray::app
