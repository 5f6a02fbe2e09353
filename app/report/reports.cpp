#include "app/report/reports.h"

#include <algorithm>
#include <numeric>

#include "app/library_calls.h"

namespace mray::app {

FrameReport report_frame(const ClipScene& scene, double frame_number, const morphray::Image& image,
                         bool with_tree) {
    FrameReport report;
    report.frame = frame_number;
    report.backend = scene.scene().device().name();
    report.update = to_string(scene.update().step);
    report.reason = scene.update().reason;
    report.cost_ratio = scene.update().cost_ratio;
    report.refit_on = scene.refitted_on();
    report.times = scene.times();
    report.hits_hash = image.hits_hash;
    report.image_hash = image.image_hash;
    if (with_tree) {
        const morphray::TreeStatistics tree =
            call_library([&] { return scene.scene().tree_statistics(); });
        report.bvh_hash = tree.hash;
        report.sah_cost = tree.sah_cost;
    }
    report.hits = static_cast<std::uint64_t>(
        std::ranges::count_if(image.hits, [](const morphray::Hit& hit) { return bool{hit}; }));
    report.misses = image.hits.size() - report.hits;
    report.occluded =
        std::accumulate(image.occlusion.begin(), image.occlusion.end(), std::uint64_t{0});
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

std::uint64_t DiffReport::differing_images() const {
    return static_cast<std::uint64_t>(std::ranges::count_if(
        images, [](const FrameDifference& difference) { return difference.total() != 0; }));
}

std::uint64_t DiffReport::differing_pixels() const {
    std::uint64_t count = 0;
    for (const FrameDifference& difference : images) count += difference.total();
    return count;
}

}  // namespace mray::app
