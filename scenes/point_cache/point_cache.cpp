#include "scenes/point_cache/point_cache.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>

#include "common/base/errors.h"
#include "common/text/message_text.h"

namespace mray {
namespace {

// With its zero at the end.
constexpr std::string_view kPc2Name("POINTCACHE2\0", 12);
constexpr std::uint64_t kPc2HeadSize = 32;
constexpr std::uint64_t kMddHeadSize = 8;
// Beyond this neighbouring frames are no longer told apart.
constexpr double kMostFrame = 1e9;

std::uint32_t swapped(std::uint32_t x) { return __builtin_bswap32(x); }

// Points that are read, and have their bytes swapped, at a time: few enough to stay in the cache.
constexpr std::size_t kPartPoints = 16 * 1024;

/// Swaps the bytes of every number of 32 bits, two numbers at a time.
void swap_all(std::span<std::byte> bytes) {
    std::size_t i = 0;
    for (; i + sizeof(std::uint64_t) <= bytes.size(); i += sizeof(std::uint64_t)) {
        std::uint64_t two = 0;
        std::memcpy(&two, &bytes[i], sizeof two);
        two = std::rotl(__builtin_bswap64(two), 32);
        std::memcpy(&bytes[i], &two, sizeof two);
    }
    if (i == bytes.size()) return;
    std::uint32_t one = 0;
    std::memcpy(&one, &bytes[i], sizeof one);
    one = swapped(one);
    std::memcpy(&bytes[i], &one, sizeof one);
}

bool is_mdd_name(const std::filesystem::path& path) {
    const std::string extension = path.extension().native();
    return extension == ".mdd" || extension == ".MDD";
}

}  // namespace

PointCache::PointCache(const std::filesystem::path& path) : file_(path) {
    static_assert(std::endian::native == std::endian::little);
    std::array<char, kPc2Name.size()> name = {};
    if (file_.size() >= name.size()) file_.read(0, std::as_writable_bytes(std::span(name)));
    if (std::string_view(name.data(), name.size()) == kPc2Name) {
        read_pc2_head();
    } else if (is_mdd_name(path)) {
        read_mdd_head();
    } else {
        fail("not a point cache; give a .pc2 or an .mdd file");
    }
    if (sample_count_ == 0) fail("has no samples; write it again");
    if (point_count_ == 0) fail("has no points; write it again");
    require_size();
}

void PointCache::read_pc2_head() {
    struct {
        std::uint32_t version;
        std::uint32_t points;
        float first_frame;
        float frames_per_sample;
        std::uint32_t samples;
    } head = {};
    static_assert(sizeof head + kPc2Name.size() == kPc2HeadSize);
    if (file_.size() < kPc2HeadSize) fail("ends within its head; is it complete?");
    file_.read(kPc2Name.size(), std::as_writable_bytes(std::span(&head, 1)));
    if (head.version != 1) fail(fmt::format("has version {}; only 1 is known", head.version));
    head_size_ = kPc2HeadSize;
    point_count_ = head.points;
    sample_count_ = head.samples;
    first_frame_ = static_cast<double>(head.first_frame);
    frames_per_sample_ = static_cast<double>(head.frames_per_sample);
    const double last = first_frame_ + frames_per_sample_ * static_cast<double>(sample_count_);
    if (!(frames_per_sample_ >= 1 / kMostFrame) || !(std::abs(first_frame_) <= kMostFrame) ||
        !(last <= kMostFrame)) {
        fail(
            fmt::format("has {} samples from frame {} in steps of {}; steps must be above 0, and "
                        "frames within {}",
                        sample_count_, first_frame_, frames_per_sample_, kMostFrame));
    }
}

void PointCache::read_mdd_head() {
    std::array<std::uint32_t, 2> head = {};
    if (file_.size() < kMddHeadSize) fail("ends within its head; is it complete?");
    file_.read(0, std::as_writable_bytes(std::span(head)));
    is_big_endian_ = true;
    sample_count_ = swapped(head[0]);
    point_count_ = swapped(head[1]);
    head_size_ = kMddHeadSize + std::uint64_t{4} * sample_count_;
}

void PointCache::require_size() const {
    const std::uint64_t sample_bytes = std::uint64_t{sizeof(vec3)} * point_count_;
    // Both numbers are below 2^32, so that only the product with the 12 bytes may be too large.
    if (sample_count_ > (std::uint64_t{1} << 62) / sample_bytes ||
        file_.size() != head_size_ + sample_bytes * sample_count_) {
        fail(
            fmt::format("has {} bytes, but its head tells of {} samples of {} points; is it "
                        "complete?",
                        file_.size(), sample_count_, point_count_));
    }
}

void PointCache::fail(const std::string& what) const {
    throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", shown(path()), what));
}

void PointCache::read(std::size_t sample, std::span<vec3> out) const {
    static_assert(sizeof(vec3) == 3 * sizeof(std::uint32_t));
    std::uint64_t offset = head_size_ + std::uint64_t{sizeof(vec3)} * point_count_ * sample;
    if (!is_big_endian_) return file_.read(offset, std::as_writable_bytes(out));
    while (!out.empty()) {
        const std::span<vec3> part = out.first(std::min(kPartPoints, out.size()));
        file_.read(offset, std::as_writable_bytes(part));
        swap_all(std::as_writable_bytes(part));
        offset += part.size_bytes();
        out = out.subspan(part.size());
    }
}

}  // namespace mray
