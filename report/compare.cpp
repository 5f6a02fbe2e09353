#include "report/compare.h"

#include <fmt/format.h>

#include <bit>
#include <cassert>

#include "common/text/text.h"

namespace mray {
namespace {

using Count = std::uint64_t FrameDifference::*;

bool same_bits(float a, float b) {
    return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

/// The count that a pixel belongs to; null where the frames are equal.
Count difference_at(const Frame& expected, const Frame& actual, std::size_t i) {
    const Hit& e = expected.hits[i];
    const Hit& a = actual.hits[i];
    if (e.prim_id != a.prim_id) {
        if (a.prim_id == kNoPrim) return &FrameDifference::false_miss;
        return e.prim_id == kNoPrim ? &FrameDifference::false_hit : &FrameDifference::prim_id;
    }
    if (!same_bits(e.t, a.t)) return &FrameDifference::t;
    if (!same_bits(e.u, a.u) || !same_bits(e.v, a.v)) return &FrameDifference::uv;
    if (expected.occlusion[i] != actual.occlusion[i]) return &FrameDifference::occlusion;
    if (expected.pixels[i] != actual.pixels[i]) return &FrameDifference::colour;
    return nullptr;
}

}  // namespace

FrameDifference compare_frames(const Frame& expected, const Frame& actual, std::size_t keep) {
    assert(expected.width == actual.width && expected.height == actual.height);
    assert(expected.hits.size() == actual.hits.size());
    assert(expected.occlusion.size() == actual.occlusion.size());
    assert(expected.pixels.size() == actual.pixels.size());
    FrameDifference difference;
    for (std::size_t i = 0; i < expected.hits.size(); ++i) {
        const Count count = difference_at(expected, actual, i);
        if (count == nullptr) continue;
        ++(difference.*count);
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

std::string describe(const Hit& hit) {
    if (hit.prim_id == kNoPrim) return "miss";
    return fmt::format("t {} u {} v {} prim {}", hex_text(hit.t), hex_text(hit.u), hex_text(hit.v),
                       hit.prim_id);
}

std::string describe(const FrameDifference& difference) {
    const std::uint64_t total = difference.total();
    if (total == 0) return "equal";
    std::string text = total == 1 ? "1 pixel differs" : fmt::format("{} pixels differ", total);
    const char* separator = ": ";
    const auto add = [&](std::uint64_t count, const char* one, const char* several) {
        if (count == 0) return;
        text += fmt::format("{}{} {}", separator, count, count == 1 ? one : several);
        separator = ", ";
    };
    add(difference.false_miss, "false miss", "false misses");
    add(difference.false_hit, "false hit", "false hits");
    add(difference.prim_id, "prim_id", "prim_id");
    add(difference.t, "t", "t");
    add(difference.uv, "u or v", "u or v");
    add(difference.occlusion, "occlusion", "occlusion");
    add(difference.colour, "colour", "colour");
    return text;
}

}  // namespace mray
