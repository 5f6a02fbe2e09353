#include "tests/fuzz/shrink/failure_report.h"

#include <fmt/format.h>

#include <cstdio>
#include <optional>
#include <set>

#include "app/base/options.h"
#include "common/base/errors.h"
#include "tests/fuzz/shrink/reproducer.h"
#include "tests/fuzz/shrink/shrinker.h"

namespace mray::fuzz {
namespace {

/// Whether an image differs in occlusion and colours alone.
bool is_secondary(const FrameDifference& d) { return d.total() == d.occlusion + d.colour; }

/// Whether two failures are of one kind, which must not change while a case shrinks: otherwise a
/// failure of secondary rays could turn into one of camera rays that the case has, too.
bool are_alike(const Finding& a, const Finding& b) {
    return a.variant == b.variant && a.answer.asked == b.answer.asked &&
           (!a.is_image() || is_secondary(a.image) == is_secondary(b.image));
}

/// A finding of the same kind in a case, traced by the variant of the original finding alone.
std::optional<Finding> find_again(Referee& referee, const FuzzCase& fuzz_case,
                                  const Finding& original) {
    Tally ignored;
    try {
        for (const Finding& finding :
             check_case(referee, fuzz_case, std::span(original.variant, 1), ignored))
            if (are_alike(finding, original)) return finding;
    } catch (const Error& error) {
        // A step of the shrinker may give a case that cannot be traced.
        if (error.kind() != ErrorKind::kBadInput) throw;
    }
    return std::nullopt;
}

FuzzCase shrunk(Referee& referee, const FuzzCase& fuzz_case, const Finding& original) {
    return shrink(fuzz_case, [&](const FuzzCase& smaller) -> std::optional<FailurePlace> {
        const std::optional<Finding> found = find_again(referee, smaller, original);
        if (!found) return std::nullopt;
        if (found->is_about_points()) return FailurePlace{0, 0, 0, found->answer.index};
        if (!found->is_image()) return FailurePlace{0, 0, found->answer.index};
        return FailurePlace{found->image.first.front().x, found->image.first.front().y, 0};
    });
}

std::string kind_of(const Finding& finding, const FuzzCase& fuzz_case) {
    return finding.is_image() ? app::name_of_rays(fuzz_case.view.rays)
                              : name_of(finding.answer.asked);
}

std::string names_of(std::span<const Finding> findings) {
    std::set<std::string> names;
    for (const Finding& finding : findings) names.insert(finding.variant->name());
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : "; ") + name;
    return text;
}

std::string size_text(const FuzzCase& fuzz_case) {
    std::string text =
        fmt::format("{} triangles, {} poses", fuzz_case.triangles.size(), fuzz_case.poses.size());
    if (fuzz_case.has_image())
        text += fmt::format(", {}x{} pixels, {}", fuzz_case.view.width, fuzz_case.view.height,
                            app::name_of_rays(fuzz_case.view.rays));
    if (!fuzz_case.rays.empty()) text += fmt::format(", {} single rays", fuzz_case.rays.size());
    if (!fuzz_case.points.empty()) text += fmt::format(", {} points", fuzz_case.points.size());
    return text;
}

}  // namespace

void report_failure(const FailureConfig& config, const FuzzCase& fuzz_case,
                    std::span<const Finding> findings, const std::string& name, Referee& referee) {
    const std::string kind = kind_of(findings.front(), fuzz_case);
    if (config.only_list) {
        std::printf("%s | %s | %s | %s\n", name.c_str(), kind.c_str(), names_of(findings).c_str(),
                    fuzz_case.cause.c_str());
        std::fflush(stdout);
        return;
    }
    const FuzzCase small = shrunk(referee, fuzz_case, findings.front());
    const std::optional<Finding> left = find_again(referee, small, findings.front());
    if (!left) {
        // The answer changes from one trace to the next.
        std::printf("FAILED %s, but not each time\n%s\n", name.c_str(),
                    describe(findings.front()).c_str());
        std::fflush(stdout);
        return;
    }
    const std::string what = describe(*left);
    const std::filesystem::path folder = config.out / name;
    const Reproducer reproducer =
        write_reproducer(small, *left, folder, config.program, "failed: " + what);
    std::printf("FAILED %s (%s): %s\nfound by: %s\nshrunk to %s:\n%s\n%s/case.txt: %s\n%s\n\n",
                name.c_str(), kind.c_str(), fuzz_case.cause.c_str(), names_of(findings).c_str(),
                size_text(small).c_str(), what.c_str(), folder.c_str(), reproducer.remark.c_str(),
                reproducer.line.c_str());
    std::fflush(stdout);
}

}  // namespace mray::fuzz
