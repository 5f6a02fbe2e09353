// Points of `query`.
#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstdint>

#include "app/files/ray_reader.h"
#include "tests/fuzz/targets/outcome.h"
#include "tests/fuzz/targets/targets.h"

namespace mray::fuzz {
namespace {

constexpr std::string_view kName = "case.txt";

bool same(float a, float b) {
    return (std::isnan(a) && std::isnan(b)) ||
           std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

/// Reads all points, and each again from its text.
std::string read_all(app::PointReader reader) {
    std::uint64_t count = 0;
    for (morphray::Vec3 point; reader.next(point); ++count) {
        if (reader.position() > reader.total()) return "more points than there can be";
        const std::string text = fmt::format("{:.9g} {:.9g} {:.9g}", point.x, point.y, point.z);
        app::PointReader again(kName, text);
        morphray::Vec3 copy;
        if (!again.next(copy) || !same(point.x, copy.x) || !same(point.y, copy.y) ||
            !same(point.z, copy.z))
            return "another point is read from its text";
    }
    return count <= reader.total() ? "" : "more points than there can be";
}

}  // namespace

std::string points_failure(std::string_view bytes) {
    return failure_of(kName, [&] { return read_all(app::PointReader(kName, bytes)); });
}

}  // namespace mray::fuzz
