#include "scenes/sequence/point_cache.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/text_parts.h"
#include "scenes/mesh/mesh_rules.h"
#include "scenes/sequence/streamed_clip.h"

namespace mray {
namespace {

/// A file in one of two formats, told apart by its first bytes and its name:
///
/// - PC2 (Autodesk 3ds Max, Blender): "POINTCACHE2" and a zero; version 1, the number of points,
/// the
///   first frame, the frames from a sample to the next, the number of samples; then x, y, z of
///   every point of every sample. Little-endian, 32 bits a number.
/// - MDD (NewTek LightWave; its name ends with .mdd): the numbers of samples and points; a time for
///   each sample, which is not used; then as above. Big-endian. Samples are frames 0, 1, 2, ...
///
/// Threads may share one.
class PointCache {
public:
    /// Reads the head. Throws Error(kBadInput) with the file and the reason if it is not such a
    /// file, if its size is not what the head says, or if it has no samples.
    explicit PointCache(const std::filesystem::path& path);

    const std::filesystem::path& path() const { return file_.path(); }
    std::size_t sample_count() const { return sample_count_; }
    std::uint32_t point_count() const { return point_count_; }
    /// The frame of a sample; frames increase.
    double frame(std::size_t sample) const {
        return first_frame_ + static_cast<double>(sample) * frames_per_sample_;
    }
    /// Reads the positions of a sample; out has point_count() entries. Throws Error(kBadInput) if
    /// the file cannot be read.
    void read(std::size_t sample, std::span<vec3> out) const;

private:
    void read_pc2_head();
    void read_mdd_head();
    [[noreturn]] void fail(const std::string& what) const;
    void require_size() const;

    InputFile file_;
    bool is_big_endian_ = false;
    std::uint64_t head_size_ = 0;
    std::size_t sample_count_ = 0;
    std::uint32_t point_count_ = 0;
    double first_frame_ = 0;
    double frames_per_sample_ = 1;
};

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
    throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", escape(path()), what));
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

class CacheSource : public KeyframeSource {
public:
    CacheSource(const std::filesystem::path& cache, bool lenient)
        : cache_(cache), lenient_(lenient) {}

    std::uint32_t point_count() const { return cache_.point_count(); }

    std::size_t count() const override { return cache_.sample_count(); }
    double frame(std::size_t keyframe) const override { return cache_.frame(keyframe); }

    std::optional<Warning> read(std::size_t keyframe, std::span<vec3> out) const override {
        cache_.read(keyframe, out);
        const auto bad = std::ranges::find_if_not(
            out, [](const vec3& p) { return MeshRules::are_good(std::span(&p, 1)); });
        if (bad == out.end()) return std::nullopt;
        const std::string place = escape(cache_.path());
        const std::string what =
            fmt::format("frame {}: vertex {} has a coordinate that is not finite or beyond 1e30",
                        frame(keyframe), bad - out.begin());
        if (lenient_) return Warning{place, what + "; kept as it is"};
        throw Error(ErrorKind::kBadInput, fmt::format("{}: {}; repair it", place, what),
                    Hint::kLenient);
    }

private:
    PointCache cache_;
    bool lenient_;
};

}  // namespace

std::unique_ptr<Clip> open_cached(const std::filesystem::path& mesh,
                                  const std::filesystem::path& cache, const std::string& name,
                                  const ClipOptions& options) {
    FirstMesh first = read_first_mesh(mesh, options);
    auto source = std::make_unique<CacheSource>(cache, options.lenient);
    if (source->point_count() != first.topology.vertex_count) {
        throw Error(ErrorKind::kBadInput,
                    fmt::format("{}: has {} points, but {} has {} vertices; give the mesh that "
                                "the cache was written for",
                                escape(cache), source->point_count(), escape(mesh),
                                first.topology.vertex_count));
    }
    return stream_keyframes({.name = name, .first = std::move(first)}, std::move(source), options);
}

}  // namespace mray
