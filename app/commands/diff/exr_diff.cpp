#include "app/commands/diff/exr_diff.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/base/output_folder.h"
#include "app/commands/diff/exr_comparison.h"
#include "app/report/exr_diff_report.h"
#include "app/terminal/interrupt.h"
#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/text/message_text.h"

namespace mray::app {
namespace {

// Pixels that are described.
constexpr std::size_t kShownPixels = 3;

std::string pixels_text(std::uint64_t pixels) {
    return fmt::format("{} pixel{}", pixels, pixels == 1 ? "" : "s");
}

/// Returns the text about a channel that follows its name and type.
std::string verdict(const ExrChannelDifference& channel) {
    if (channel.pixels == 0) return "equal";
    std::string text = pixels_text(channel.pixels);
    if (channel.by != 0)
        text += fmt::format(", at most {:.6g}, by {:+.6g} at pixel {},{}", std::abs(channel.by),
                            channel.by, channel.x, channel.y);
    else
        text += fmt::format(", the first at {},{}", channel.x, channel.y);
    if (channel.not_finite > 0) text += fmt::format("; {} not finite", channel.not_finite);
    return text;
}

std::string line_of(const ExrChannelDifference& channel, const ExrDiffReport& report) {
    const std::string name = shown(channel.name);
    if (!channel.actual_type)
        return fmt::format("  {:<14} only in {}\n", name, shown(report.expected));
    if (!channel.expected_type)
        return fmt::format("  {:<14} only in {}\n", name, shown(report.actual));
    if (!channel.is_compared())
        return fmt::format("  {:<14} {} in {}, but {} in {}\n", name,
                           name_of(*channel.expected_type), shown(report.expected),
                           name_of(*channel.actual_type), shown(report.actual));
    return fmt::format("  {:<14} {:<5}  {}\n", name, name_of(*channel.actual_type),
                       verdict(channel));
}

std::string summary(const ExrDiffReport& report) {
    const ExrComparison& found = report.comparison;
    const std::string shape = fmt::format("OpenEXR image of {}x{}", found.width, found.height);
    if (found.equal()) return shape + ": equal bit by bit\n";
    if (found.pixels() == 0)
        return shape + ": all compared channels are equal, but not all could be compared\n";
    std::string text =
        fmt::format("{}: {} differ{} of {}", shape, pixels_text(found.pixels()),
                    found.pixels() == 1 ? "s" : "", std::uint64_t{found.width} * found.height);
    const char* separator = ": ";
    for (std::size_t k = 0; k < kExrKindCount; ++k) {
        if (found.kinds[k] == 0) continue;
        text += fmt::format("{}{} {}", separator, found.kinds[k],
                            info_of(static_cast<ExrKind>(k)).name);
        separator = ", ";
    }
    return text + '\n';
}

std::string text_of(const ExrDiffReport& report) {
    const ExrComparison& found = report.comparison;
    std::string text = summary(report);
    if (found.equal()) return text;
    for (const ExrChannelDifference& channel : found.channels) text += line_of(channel, report);
    for (std::size_t i = 0; i < std::min(found.first.size(), kShownPixels); ++i) {
        const ExrPixelDifference& pixel = found.first[i];
        text += fmt::format("  pixel {},{}\n", pixel.x, pixel.y);
        for (const ExrPixelDifference::Value& value : pixel.values) {
            const ExrChannelDifference& channel = found.channels[value.channel];
            const ExrType type = *channel.actual_type;
            text += fmt::format("    {:<14} expected {}, actual {}\n", shown(channel.name),
                                value_text(type, value.expected), value_text(type, value.actual));
        }
    }
    return text;
}

void require_same_size(const std::vector<std::string>& names, const ExrReader& expected,
                       const ExrReader& actual) {
    if (expected.width() == actual.width() && expected.height() == actual.height()) return;
    throw Error(ErrorKind::kBadInput,
                fmt::format("{}: has {}x{} pixels, but {} has {}x{}; only images of the same size "
                            "can be compared",
                            shown(names[1]), actual.width(), actual.height(), shown(names[0]),
                            expected.width(), expected.height()));
}

}  // namespace

ExitCode run_exr_diff(const Options& options, const Messages& messages) {
    const std::vector<std::string>& names = options.compared_files;
    ExrReader expected(names[0]);
    ExrReader actual(names[1]);
    require_same_size(names, expected, actual);
    Image image;
    Image* const wanted = options.out.empty() ? nullptr : &image;
    const ExrDiffReport report{names[0], names[1],
                               compare_exr(expected, actual, throw_if_interrupted, wanted)};
    if (wanted != nullptr) {
        const OutputFolder folder(options.out);
        if (report.comparison.pixels() > 0)
            write_file(folder.path() / "difference.png", encode_png(image));
    }
    if (!options.json.empty()) write_report(options.json, to_json(report));
    if (!takes_stdout({options.json})) messages.print(text_of(report));
    return report.comparison.equal() ? ExitCode::kOk : ExitCode::kCheckFailed;
}

}  // namespace mray::app
