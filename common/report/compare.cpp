#include "common/report/compare.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cassert>
#include <iterator>
#include <optional>

namespace mray {
namespace {

struct DifferenceKind {
    std::uint64_t FrameDifference::*count;
    const char* one;
    const char* several;
    std::uint32_t colour;
};

enum class Kind { kFalseMiss, kFalseHit, kPrimId, kT, kUv, kOcclusion, kColour };
constexpr std::size_t kKindCount = 7;
/// In the order of Kind.
constexpr std::array<DifferenceKind, kKindCount> kKinds = {{
    {&FrameDifference::false_miss, "false miss", "false misses", 0xFF0000FF},  // red
    {&FrameDifference::false_hit, "false hit", "false hits", 0xFF00A5FF},      // orange
    {&FrameDifference::prim_id, "prim_id", "prim_id", 0xFF00FFFF},             // yellow
    {&FrameDifference::t, "t", "t", 0xFF00FF00},                               // green
    {&FrameDifference::uv, "u or v", "u or v", 0xFFFFFF00},                    // cyan
    {&FrameDifference::occlusion, "occlusion", "occlusion", 0xFFFF4040},       // blue
    {&FrameDifference::colour, "colour", "colour", 0xFFFF00FF},                // magenta
}};

const DifferenceKind& info(Kind kind) { return kKinds[static_cast<std::size_t>(kind)]; }

bool same_bits(float a, float b) {
    return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

std::optional<Kind> difference_at(const Frame& expected, const Frame& actual, std::size_t i) {
    const Hit& e = expected.hits[i];
    const Hit& a = actual.hits[i];
    if (e.prim_id != a.prim_id) {
        if (a.prim_id == kNoPrim) return Kind::kFalseMiss;
        if (e.prim_id == kNoPrim) return Kind::kFalseHit;
        return Kind::kPrimId;
    }
    if (!same_bits(e.t, a.t)) return Kind::kT;
    if (!same_bits(e.u, a.u) || !same_bits(e.v, a.v)) return Kind::kUv;
    if (expected.occlusion[i] != actual.occlusion[i]) return Kind::kOcclusion;
    if (expected.pixels[i] != actual.pixels[i]) return Kind::kColour;
    return std::nullopt;
}

void assert_comparable([[maybe_unused]] const Frame& expected,
                       [[maybe_unused]] const Frame& actual) {
    assert(expected.width == actual.width && expected.height == actual.height);
    for ([[maybe_unused]] const Frame* frame : {&expected, &actual}) {
        [[maybe_unused]] const std::size_t size = std::size_t{frame->width} * frame->height;
        assert(frame->hits.size() == size);
        assert(frame->occlusion.size() == size);
        assert(frame->pixels.size() == size);
    }
}

std::uint32_t grey(std::uint32_t pixel) {
    const std::uint32_t sum =
        (pixel & 0xFF) + 2 * ((pixel >> 8) & 0xFF) + ((pixel >> 16) & 0xFF);  // about luminance
    return 0xFF000000 | (sum / 4) * 0x010101;
}

/// Paints the 3x3 pixels around (x, y) that exist.
void paint_around(Image& image, std::uint32_t x, std::uint32_t y, std::uint32_t colour) {
    const std::uint32_t left = x == 0 ? 0 : x - 1;
    const std::uint32_t top = y == 0 ? 0 : y - 1;
    for (std::uint32_t row = top; row <= y + 1 && row < image.height; ++row) {
        for (std::uint32_t column = left; column <= x + 1 && column < image.width; ++column) {
            image.pixels[std::size_t{row} * image.width + column] = colour;
        }
    }
}

}  // namespace

FrameDifference compare_frames(const Frame& expected, const Frame& actual, std::size_t keep) {
    assert_comparable(expected, actual);
    FrameDifference difference;
    for (std::size_t i = 0; i < expected.hits.size(); ++i) {
        const std::optional<Kind> kind = difference_at(expected, actual, i);
        if (!kind) continue;
        ++(difference.*info(*kind).count);
        if (difference.first.size() >= keep) continue;
        difference.first.push_back({.x = static_cast<std::uint32_t>(i % expected.width),
                                    .y = static_cast<std::uint32_t>(i / expected.width),
                                    .expected = expected.hits[i],
                                    .actual = actual.hits[i],
                                    .expected_occlusion = expected.occlusion[i],
                                    .actual_occlusion = actual.occlusion[i],
                                    .expected_pixel = expected.pixels[i],
                                    .actual_pixel = actual.pixels[i]});
    }
    return difference;
}

Image marked_image(const Image& image, std::span<const PixelMark> marks) {
    Image marked{.width = image.width, .height = image.height, .pixels = {}};
    marked.pixels.reserve(image.pixels.size());
    for (const std::uint32_t pixel : image.pixels) marked.pixels.push_back(grey(pixel));
    for (const PixelMark& mark : marks) {
        paint_around(marked, static_cast<std::uint32_t>(mark.index % image.width),
                     static_cast<std::uint32_t>(mark.index / image.width), mark.colour);
    }
    // A neighbour's enlarged mark must not hide a pixel's own colour.
    for (const PixelMark& mark : marks) marked.pixels[mark.index] = mark.colour;
    return marked;
}

Image difference_image(const Frame& expected, const Frame& actual) {
    assert_comparable(expected, actual);
    std::vector<PixelMark> marks;
    for (std::size_t i = 0; i < expected.hits.size(); ++i) {
        const std::optional<Kind> kind = difference_at(expected, actual, i);
        if (kind) marks.push_back({i, info(*kind).colour});
    }
    return marked_image({actual.width, actual.height, actual.pixels}, marks);
}

std::string describe(const FrameDifference& difference) {
    const std::uint64_t total = difference.total();
    if (total == 0) return "equal";
    std::string text = total == 1 ? "1 pixel differs" : fmt::format("{} pixels differ", total);
    const char* separator = ": ";
    for (const DifferenceKind& kind : kKinds) {
        const std::uint64_t count = difference.*kind.count;
        if (count == 0) continue;
        fmt::format_to(std::back_inserter(text), "{}{} {}", separator, count,
                       count == 1 ? kind.one : kind.several);
        separator = ", ";
    }
    return text;
}

}  // namespace mray
