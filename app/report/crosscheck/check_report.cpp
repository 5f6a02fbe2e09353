#include "app/report/crosscheck/check_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/image/png.h"

namespace mray::app {
namespace {

// The side of an image in a page, in pixels.
constexpr std::uint32_t kMostSide = 256;

template <class Rows>
std::size_t count_differing(const Rows& rows) {
    return static_cast<std::size_t>(
        std::ranges::count_if(rows, [](const auto& row) { return !row.equal(); }));
}

/// The first of `kept` pixels that has `at` in its middle, if the image of `size` allows it.
std::uint32_t window_begin(std::uint32_t at, std::uint32_t size, std::uint32_t kept) {
    const std::uint32_t begin = at > kept / 2 ? at - kept / 2 : 0;
    return std::min(begin, size - kept);
}

Image cut(const Image& image, const RowImages& window) {
    Image part{window.width, window.height, {}};
    for (std::uint32_t y = 0; y < window.height; ++y) {
        const auto begin =
            image.pixels.begin() +
            static_cast<std::ptrdiff_t>(std::size_t{window.top + y} * image.width + window.left);
        part.pixels.insert(part.pixels.end(), begin, begin + window.width);
    }
    return part;
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

RowImages images_of(std::size_t row_index, const CheckRow& row, const Frame& expected,
                    const Frame& actual) {
    RowImages images;
    images.row = row_index;
    images.width = std::min(actual.width, kMostSide);
    images.height = std::min(actual.height, kMostSide);
    const PixelDifference first =
        row.difference.first.empty() ? PixelDifference{} : row.difference.first.front();
    images.left = window_begin(first.x, actual.width, images.width);
    images.top = window_begin(first.y, actual.height, images.height);
    const auto encode = [&images](const Image& image) { return encode_png(cut(image, images)); };
    images.expected = encode({expected.width, expected.height, expected.pixels});
    images.actual = encode({actual.width, actual.height, actual.pixels});
    images.difference = encode(difference_image(expected, actual));
    return images;
}

std::size_t CheckReport::differing() const {
    return count_differing(rows) + count_differing(trees) + count_differing(queries) +
           count_differing(expected);
}

bool CheckRun::complete() const {
    return error.empty() &&
           std::ranges::all_of(scenes, [](const CheckReport& scene) { return scene.complete; });
}

bool CheckRun::equal() const {
    return std::ranges::all_of(scenes, [](const CheckReport& scene) { return scene.equal(); });
}

std::size_t CheckRun::warnings() const {
    std::size_t count = 0;
    for (const CheckReport& scene : scenes) count += scene.warnings.size();
    return count;
}

}  // namespace mray::app
