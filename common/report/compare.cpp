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
};

enum class Kind { kFalseMiss, kFalseHit, kPrimId, kT, kUv, kOcclusion, kColour };
constexpr std::size_t kKindCount = 7;
/// In the order of Kind.
constexpr std::array<DifferenceKind, kKindCount> kKinds = {{
    {&FrameDifference::false_miss, "false miss", "false misses"},
    {&FrameDifference::false_hit, "false hit", "false hits"},
    {&FrameDifference::prim_id, "prim_id", "prim_id"},
    {&FrameDifference::t, "t", "t"},
    {&FrameDifference::uv, "u or v", "u or v"},
    {&FrameDifference::occlusion, "occlusion", "occlusion"},
    {&FrameDifference::colour, "colour", "colour"},
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
