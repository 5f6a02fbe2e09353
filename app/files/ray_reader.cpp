#include "app/files/ray_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>

#include "common/base/errors.h"

namespace mray::app {
namespace {

constexpr std::size_t kMostNumbers = 8;

WorldRay to_ray(const std::array<double, kMostNumbers>& n) {
    return {{n[0], n[1], n[2]}, {n[3], n[4], n[5]}, n[6], n[7]};
}

}  // namespace

bool RayTextReader::next(WorldRay& ray) {
    std::array<double, kMostNumbers> numbers = {0, 0, 0, 0,
                                                0, 0, 0, std::numeric_limits<double>::infinity()};
    const std::size_t count = lines_.next(numbers);
    if (count == 0) return false;
    if (count != 6 && count != kMostNumbers) lines_.fail(fmt::format("{} numbers", count));
    ray = to_ray(numbers);
    return true;
}

RayBinaryReader::RayBinaryReader(std::string_view name, std::string_view bytes) : rest_(bytes) {
    constexpr std::size_t kRayBytes = kMostNumbers * sizeof(float);
    if (bytes.size() % kRayBytes == 0) return;
    throw Error(
        ErrorKind::kBadInput,
        fmt::format("{}: {} bytes are not a whole number of rays of {} bytes; write 8 floats "
                    "a ray",
                    name, bytes.size(), kRayBytes));
}

bool RayBinaryReader::next(WorldRay& ray) {
    static_assert(std::endian::native == std::endian::little, "read as memory is");
    if (rest_.empty()) return false;
    std::array<float, kMostNumbers> floats;
    std::memcpy(floats.data(), rest_.data(), sizeof(floats));
    rest_.remove_prefix(sizeof(floats));
    std::array<double, kMostNumbers> numbers;
    std::copy(floats.begin(), floats.end(), numbers.begin());
    ray = to_ray(numbers);
    ++count_;
    return true;
}

}  // namespace mray::app
