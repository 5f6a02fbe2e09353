#include "app/commands/diff/png_diff.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "app/files/image_reader.h"
#include "app/report/diff_report.h"
#include "common/base/output_file.h"
#include "common/text/message_text.h"

namespace mray::app {
namespace {

// Pixels that are described.
constexpr std::size_t kShownPixels = 3;

/// An image without hits, so that its colours alone are compared.
Frame frame_of(Image image) {
    const std::size_t size = image.pixels.size();
    return {image.width, image.height, AlignedVector<Hit>(size, no_hit()),
            std::vector<std::uint32_t>(size), std::move(image.pixels)};
}

ImageDiffReport compare_images(const Frame& expected, const Frame& actual) {
    ImageDiffReport report;
    report.width = actual.width;
    report.height = actual.height;
    report.difference = compare_frames(expected, actual);
    for (std::size_t i = 0; i < actual.pixels.size(); ++i) {
        if (expected.pixels[i] == actual.pixels[i]) continue;
        for (std::size_t c = 0; c < report.channels.size(); ++c) {
            const auto value = [&](std::uint32_t pixel) {
                return static_cast<int>((pixel >> (8 * c)) & 0xFF);
            };
            const int by = value(actual.pixels[i]) - value(expected.pixels[i]);
            ImageDiffReport::Channel& channel = report.channels[c];
            if (std::abs(by) <= std::abs(channel.by)) continue;
            channel = {by, static_cast<std::uint32_t>(i % actual.width),
                       static_cast<std::uint32_t>(i / actual.width)};
        }
    }
    return report;
}

std::string text_of(const ImageDiffReport& report) {
    const std::string shape = fmt::format("image of {}x{}", report.width, report.height);
    if (report.equal()) return shape + ": equal bit by bit\n";
    const std::uint64_t pixels = report.difference.total();
    std::string text =
        fmt::format("{}: {} pixel{} of {}\n", shape, pixels, pixels == 1 ? " differs" : "s differ",
                    std::uint64_t{report.width} * report.height);
    for (std::size_t c = 0; c < report.channels.size(); ++c) {
        const ImageDiffReport::Channel& channel = report.channels[c];
        text += channel.by == 0
                    ? fmt::format("  {:<5}  equal\n", kChannelNames[c])
                    : fmt::format("  {:<5}  at most {}, by {:+} at pixel {},{}\n", kChannelNames[c],
                                  std::abs(channel.by), channel.by, channel.x, channel.y);
    }
    const auto& first = report.difference.first;
    for (std::size_t k = 0; k < std::min(first.size(), kShownPixels); ++k)
        text +=
            fmt::format("  pixel {},{}: expected {}, actual {}\n", first[k].x, first[k].y,
                        colour_text(first[k].expected_pixel), colour_text(first[k].actual_pixel));
    return text;
}

}  // namespace

ExitCode run_png_diff(const Options& options, const Messages& messages) {
    const std::vector<std::string>& names = options.compared_files;
    const Frame expected = frame_of(read_png(names[0]));
    const Frame actual = frame_of(read_png(names[1]));
    if (expected.width != actual.width || expected.height != actual.height) {
        throw Error(ErrorKind::kBadInput,
                    fmt::format("{}: has {}x{} pixels, but {} has {}x{}; only images of the same "
                                "size can be compared",
                                shown(names[1]), actual.width, actual.height, shown(names[0]),
                                expected.width, expected.height));
    }
    ImageDiffReport report = compare_images(expected, actual);
    report.expected = names[0];
    report.actual = names[1];
    if (!options.json.empty()) write_report(options.json, to_json(report));
    if (!takes_stdout({options.json})) messages.print(text_of(report));
    return report.equal() ? ExitCode::kOk : ExitCode::kCheckFailed;
}

}  // namespace mray::app
