#include "tests/fuzz/shrink/report.h"

#include <fmt/format.h>

#include <cstdio>
#include <functional>

#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "tests/fuzz/case/case_text.h"
#include "tests/fuzz/shrink/shrinker.h"

namespace mray::fuzz {
namespace {

/// Says how a case fails, if it does in the way of the failure; otherwise empty.
using Failure = std::function<std::string(const FuzzCase&)>;

void report(const FailureName& name, const FuzzCase& fuzz_case, const std::string& what,
            const Failure& failure) {
    const FuzzCase small =
        shrink(fuzz_case, [&](const FuzzCase& smaller) { return !failure(smaller).empty(); });
    const std::string left = failure(small);
    const std::filesystem::path path = name.out / name.name / "case.txt";
    make_output_folder(path.parent_path());
    write_file(path, to_text(small, "failed: " + (left.empty() ? what : left)));
    fmt::print("FAILED {}{}\n{}\n./fuzz replay {} --backend {}\n\n", name.name,
               left.empty() ? ", but not each time" : "", left.empty() ? what : left, path.string(),
               name.is_on_vulkan ? "vulkan" : "cpu");
    std::fflush(stdout);
}

/// Whether an image differs in occlusion and colours alone.
bool is_secondary(const FrameDifference& d) { return d.total() == d.occlusion + d.colour; }

/// Whether two failures are of one kind, which must not change while a case shrinks: otherwise a
/// failure of secondary rays could turn into one of camera rays that the case has, too.
bool are_alike(const Finding& a, const Finding& b) {
    return a.answer.asked == b.answer.asked &&
           (!a.is_image() || is_secondary(a.image) == is_secondary(b.image));
}

}  // namespace

void report_failure(const FailureName& name, const FuzzCase& fuzz_case, const Finding& finding,
                    Referee& referee) {
    report(name, fuzz_case, describe(finding), [&](const FuzzCase& smaller) -> std::string {
        Tally ignored;
        try {
            for (const Finding& found :
                 check_case(referee, smaller, std::span(finding.variant, 1), ignored))
                if (are_alike(found, finding)) return describe(found);
        } catch (const Error& error) {
            // A step of the shrinker may give a case that cannot be traced.
            if (error.kind() != ErrorKind::kBadInput) throw;
        }
        return {};
    });
}

}  // namespace mray::fuzz
