#include "app/commands/diff/exr_comparison.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string_view>
#include <utility>

namespace mray::app {
namespace {

constexpr std::size_t kKept = 10;

using Planes = std::vector<std::vector<std::uint32_t>>;

/// Where a channel is in each file.
struct Pair {
    std::size_t expected = 0;
    std::size_t actual = 0;
};

std::optional<std::size_t> find(const std::vector<ExrChannel>& channels, std::string_view name) {
    const auto found = std::ranges::find(channels, name, &ExrChannel::name);
    if (found == channels.end()) return std::nullopt;
    return static_cast<std::size_t>(found - channels.begin());
}

class Comparer {
public:
    Comparer(ExrReader& expected, ExrReader& actual, Image* image)
        : expected_(expected), actual_(actual), image_(image) {
        comparison_.width = actual.width();
        comparison_.height = actual.height();
        add_channels();
        for (const char* name : {"R", "G", "B"})
            if (const auto at = find(actual.channels(), name)) colours_.push_back(*at);
    }

    void compare_rows(std::uint32_t row, std::uint32_t count) {
        const Planes a = expected_.read_rows(row, count);
        const Planes b = actual_.read_rows(row, count);
        const std::size_t first = std::size_t{row} * comparison_.width;
        for (std::size_t i = 0; i < std::size_t{count} * comparison_.width; ++i) {
            compare_pixel(a, b, i, first + i);
            if (image_ != nullptr) image_->pixels.push_back(colour_of(b, i));
        }
    }

    ExrComparison finish() {
        if (image_ != nullptr) {
            image_->width = comparison_.width;
            image_->height = comparison_.height;
            *image_ = marked_image(*image_, marks_);
        }
        return std::move(comparison_);
    }

private:
    void add_channels() {
        std::vector<std::string> names;
        for (const ExrReader* file : {&expected_, &actual_})
            for (const ExrChannel& channel : file->channels()) names.push_back(channel.name);
        std::ranges::sort(names);
        names.erase(std::unique(names.begin(), names.end()), names.end());
        for (const std::string& name : names) {
            const auto a = find(expected_.channels(), name);
            const auto b = find(actual_.channels(), name);
            ExrChannelDifference channel;
            channel.name = name;
            channel.kind = kind_of_channel(name);
            if (a) channel.expected_type = expected_.channels()[*a].type;
            if (b) channel.actual_type = actual_.channels()[*b].type;
            pairs_.push_back({a.value_or(0), b.value_or(0)});
            comparison_.channels.push_back(channel);
        }
    }

    void compare_pixel(const Planes& a, const Planes& b, std::size_t i, std::size_t index) {
        std::optional<ExrKind> kind;
        ExrPixelDifference pixel;
        pixel.x = static_cast<std::uint32_t>(index % comparison_.width);
        pixel.y = static_cast<std::uint32_t>(index / comparison_.width);
        for (std::size_t k = 0; k < pairs_.size(); ++k) {
            ExrChannelDifference& channel = comparison_.channels[k];
            if (!channel.is_compared()) continue;
            const std::uint32_t expected = a[pairs_[k].expected][i];
            const std::uint32_t actual = b[pairs_[k].actual][i];
            if (expected == actual) continue;
            count(channel, expected, actual, pixel);
            kind = std::min(kind.value_or(channel.kind), channel.kind);
            if (comparison_.first.size() < kKept) pixel.values.push_back({k, expected, actual});
        }
        if (!kind) return;
        const auto at = static_cast<std::size_t>(*kind);
        ++comparison_.kinds[at];
        if (comparison_.first.size() < kKept) comparison_.first.push_back(std::move(pixel));
        if (image_ != nullptr) marks_.push_back({index, info_of(*kind).colour});
    }

    static void count(ExrChannelDifference& channel, std::uint32_t expected, std::uint32_t actual,
                      const ExrPixelDifference& pixel) {
        const ExrType type = *channel.actual_type;
        const double by = value_of(type, actual) - value_of(type, expected);
        const bool is_finite = std::isfinite(by);
        if (!is_finite) ++channel.not_finite;
        const bool is_number = type != ExrType::kUint && is_finite;
        if (channel.pixels++ == 0 || (is_number && std::abs(by) > std::abs(channel.by))) {
            channel.x = pixel.x;
            channel.y = pixel.y;
            channel.by = is_number ? by : 0;
        }
    }

    /// Linear colours in [0, 1] as numbers about even to the eye.
    std::uint32_t colour_of(const Planes& b, std::size_t i) const {
        std::uint32_t pixel = 0xFF000000;
        for (std::size_t c = 0; c < colours_.size(); ++c) {
            const double value = value_of(actual_.channels()[colours_[c]].type, b[colours_[c]][i]);
            const double level = value > 0 ? std::sqrt(std::min(value, 1.0)) : 0;
            pixel |= static_cast<std::uint32_t>(std::lround(level * 255)) << (8 * c);
        }
        return pixel;
    }

    ExrReader& expected_;
    ExrReader& actual_;
    Image* image_;
    ExrComparison comparison_;
    std::vector<Pair> pairs_;
    std::vector<std::size_t> colours_;
    std::vector<PixelMark> marks_;
};

}  // namespace

ExrComparison compare_exr(ExrReader& expected, ExrReader& actual,
                          const std::function<void()>& check, Image* image) {
    assert(expected.width() == actual.width() && expected.height() == actual.height());
    // About 50 MB a file of render; OpenEXR keeps the block that a group of rows ends in.
    constexpr std::uint32_t kPixels = 1 << 20;
    const std::uint32_t rows = std::max(kPixels / actual.width(), 1u);
    Comparer comparer(expected, actual, image);
    for (std::uint32_t row = 0; row < actual.height(); row += rows) {
        check();
        comparer.compare_rows(row, std::min(rows, actual.height() - row));
    }
    return comparer.finish();
}

}  // namespace mray::app
