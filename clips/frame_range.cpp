#include "clips/frame_range.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>

#include "common/base/errors.h"
#include "common/text/message_text.h"
#include "common/text/number_text.h"

namespace mray {
namespace {

// A + n * STEP of decimal numbers such as 0..0.3:0.1 misses B by a few units in the last place.
constexpr double kHitTolerance = 1e-9;

[[noreturn]] void fail(const std::string& text, const char* what, const char* numbers) {
    throw Error(ErrorKind::kBadArgument,
                fmt::format("{} {}: {}; write A, A..B or A..B:STEP, such as "
                            "0..20:0.5",
                            numbers, in_quotes(text), what));
}

double parse_number(std::string_view number, const std::string& text, const char* numbers) {
    const auto value = parse_finite_double(number);
    if (!value) fail(text, "not finite decimal numbers", numbers);
    return *value;
}

}  // namespace

std::vector<double> parse_frame_range(const std::string& text, double default_step,
                                      const char* what) {
    const std::string_view view = text;
    const std::size_t dots = view.find("..");
    const double first = parse_number(view.substr(0, dots), text, what);
    if (dots == std::string_view::npos) return {first};

    const std::string_view rest = view.substr(dots + 2);
    const std::size_t colon = rest.find(':');
    const double last = parse_number(rest.substr(0, colon), text, what);
    const double step = colon == std::string_view::npos
                            ? default_step
                            : parse_number(rest.substr(colon + 1), text, what);
    if (last < first) fail(text, "the last frame is before the first", what);
    if (!(step > 0)) fail(text, "the step is not above 0", what);
    const double steps = (last - first) / step;
    // Also when the quotient overflows.
    if (!(steps < static_cast<double>(kMaxFrames))) fail(text, "more than a million frames", what);

    std::vector<double> frames(static_cast<std::size_t>(steps + kHitTolerance) + 1);
    for (std::size_t i = 0; i < frames.size(); ++i) {
        frames[i] = first + static_cast<double>(i) * step;
    }
    if (std::abs(frames.back() - last) <= kHitTolerance * step) frames.back() = last;
    return frames;
}

}  // namespace mray
