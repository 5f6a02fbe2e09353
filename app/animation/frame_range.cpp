#include "app/animation/frames.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>

#include "common/base/errors.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"

namespace mray::app {
namespace {

// A + n * STEP of decimal numbers such as 0..0.3:0.1 misses B by a few units in the last place.
constexpr double kHitTolerance = 1e-9;

/// The text of an option.
struct Text {
    const std::string& text;

    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("frames {}: {}; write A, A..B or A..B:STEP, such as 0..20:0.5, or "
                                "several of them with commas, such as 0,7,20",
                                quote(text), what));
    }
    double number(std::string_view number) const {
        const auto value = parse_finite_double(number);
        if (!value) fail("not finite decimal numbers");
        return *value;
    }
};

/// Appends the frames of `A`, `A..B` or `A..B:STEP`, which must come after those that are there.
void append_range(const Text& text, std::string_view range, std::vector<double>& frames) {
    const std::size_t dots = range.find("..");
    const double first = text.number(range.substr(0, dots));
    if (!frames.empty() && !(first > frames.back())) {
        text.fail(
            fmt::format("{} does not come after {}; they must increase", first, frames.back()));
    }
    double last = first;
    double step = 1;
    if (dots != std::string_view::npos) {
        const std::string_view rest = range.substr(dots + 2);
        const std::size_t colon = rest.find(':');
        last = text.number(rest.substr(0, colon));
        if (colon != std::string_view::npos) step = text.number(rest.substr(colon + 1));
    }
    if (last < first) text.fail("the last frame is before the first");
    if (!(step > 0)) text.fail("the step is not above 0");
    const double steps = (last - first) / step;
    // Also when the quotient overflows.
    if (!(steps < static_cast<double>(kMaxFrames - frames.size())))
        text.fail("more than a million frames");

    const std::size_t count = static_cast<std::size_t>(steps + kHitTolerance) + 1;
    for (std::size_t i = 0; i < count; ++i) frames.push_back(first + static_cast<double>(i) * step);
    if (std::abs(frames.back() - last) <= kHitTolerance * step) frames.back() = last;
}

}  // namespace

std::vector<double> parse_frame_range(const std::string& text) {
    std::vector<double> frames;
    std::string_view rest = text;
    for (;;) {
        const std::size_t comma = rest.find(',');
        append_range({text}, rest.substr(0, comma), frames);
        if (comma == std::string_view::npos) return frames;
        rest.remove_prefix(comma + 1);
    }
}

}  // namespace mray::app
