#include "app/report/crosscheck/check_report.h"

#include <fmt/format.h>

#include <algorithm>

namespace mray::app {
namespace {

template <class Rows>
std::size_t count_differing(const Rows& rows) {
    return static_cast<std::size_t>(
        std::ranges::count_if(rows, [](const auto& row) { return !row.equal(); }));
}

}  // namespace

std::string CheckRow::variant() const {
    const auto on = [this](const std::string& name) {
        return name == "vulkan" && !device.empty() ? name + " " + device + " (" + device_name + ")"
                                                   : name;
    };
    const std::string tracer = on(backend) + (simd.empty() ? "" : " " + simd);
    if (update != "refit") return tracer + ", rebuild";
    // A device traces no tree that another device refitted.
    return tracer + ", refit on " + (backend == "vulkan" ? refit_on : on(refit_on));
}

void compare(const Frame& expected, const Frame& actual, CheckRow& row) {
    row.difference = compare_frames(expected, actual);
    row.expected_hits_hash = hits_hash(expected);
    row.hits_hash = hits_hash(actual);
    row.expected_image_hash = image_hash(expected);
    row.image_hash = image_hash(actual);
}

std::string describe(const QueryDifference& difference) {
    std::string text;
    const auto add = [&text](std::size_t count, const char* kind, const char* in) {
        if (count == 0) return;
        text += fmt::format("{}{} {}{} in {}", text.empty() ? "" : ", ", count, kind,
                            count == 1 ? " differs" : "s differ", in);
    };
    add(difference.all_hits, "ray", "all hits");
    add(difference.winding, "point", "the winding");
    add(difference.closest, "point", "the closest triangle");
    return text;
}

std::size_t CheckReport::differing() const {
    return count_differing(rows) + count_differing(trees) + count_differing(queries);
}

bool CheckRun::complete() const {
    return error.empty() &&
           std::ranges::all_of(scenes, [](const CheckReport& scene) { return scene.complete; });
}

bool CheckRun::equal() const {
    return std::ranges::all_of(scenes, [](const CheckReport& scene) { return scene.equal(); });
}

}  // namespace mray::app
