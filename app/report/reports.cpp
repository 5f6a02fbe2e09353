#include "app/report/reports.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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

const char* name_of(IndexUse::State state) {
    switch (state) {
        case IndexUse::State::kAbsent:
            return "absent";
        case IndexUse::State::kUsed:
            return "used";
        case IndexUse::State::kStale:
            return "stale";
        case IndexUse::State::kGiven:
            return "bounds given";
        default:
            return "none";
    }
}

std::string colour_text(std::uint32_t pixel) {
    std::string text = "#";
    for (int shift = 0; shift < 32; shift += 8)
        text += fmt::format("{:02x}", (pixel >> shift) & 0xFF);
    return text;
}

std::string value_text(ExrType type, std::uint32_t bits) {
    if (type == ExrType::kUint) return fmt::format("{}", bits);
    const double value = value_of(type, bits);
    // Not all of them have the same bits.
    if (std::isnan(value)) return fmt::format("nan {:#x}", bits);
    return fmt::format("{:a}", value);
}

std::size_t BaselineReport::slower_stages() const {
    return static_cast<std::size_t>(std::ranges::count_if(
        stages, [this](const StageChange& stage) { return is_slower(stage); }));
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
