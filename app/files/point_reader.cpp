#include "app/files/point_reader.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstring>

namespace mray::app {
namespace {

static_assert(std::endian::native == std::endian::little, "read as memory is");

template <class Number>
morphray::Vec3 point_at(const char* bytes) {
    std::array<Number, 3> n;
    std::memcpy(n.data(), bytes, sizeof(n));
    return {static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])};
}

}  // namespace

PointReader::PointReader(std::string_view name, std::string_view bytes)
    : lines_(name, bytes, "x y z") {
    if (is_npy(bytes)) array_ = read_npy_points(name, bytes);
    total_ = array_ ? array_->count : count_lines(bytes);
}

bool PointReader::next(morphray::Vec3& point) {
    if (array_) {
        if (read_ == total_) return false;
        const char* const bytes = array_->numbers.data() + read_ * 3 * array_->number_bytes;
        point = array_->number_bytes == sizeof(float) ? point_at<float>(bytes)
                                                      : point_at<double>(bytes);
        ++read_;
        return true;
    }
    std::array<double, 3> numbers;
    const std::size_t count = lines_.next(numbers);
    if (count == 0) return false;
    if (count != 3) lines_.fail(fmt::format("{} number{}", count, count == 1 ? "" : "s"));
    point = {static_cast<float>(numbers[0]), static_cast<float>(numbers[1]),
             static_cast<float>(numbers[2])};
    return true;
}

}  // namespace mray::app
