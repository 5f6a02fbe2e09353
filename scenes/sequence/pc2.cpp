#include "scenes/sequence/pc2.h"

#include <fmt/format.h>

#include <bit>
#include <functional>

#include "common/base/input_file.h"
#include "common/text/text.h"
#include "scenes/sequence/streamed_animation.h"

namespace mray {
namespace {

// With its zero at the end.
constexpr std::string_view kName("POINTCACHE2\0", 12);
// Beyond this, neighbouring frames cannot be distinguished.
constexpr double kMostFrame = 1e9;

/// Then come x, y, z of every point of every sample. All numbers are little-endian.
struct Head {
    std::uint32_t version, points;
    float first_frame, frames_per_sample;
    std::uint32_t samples;
};
constexpr std::uint64_t kHeadSize = kName.size() + sizeof(Head);

class PointCache {
public:
    /// Throws Error(kBadInput) for another file, another size than the head says, or no samples.
    PointCache(const std::filesystem::path& path, bool lenient) : file_(path), lenient_(lenient) {
        static_assert(std::endian::native == std::endian::little);
        std::array<char, kName.size()> name = {};
        if (file_.size() >= name.size()) file_.read(0, std::as_writable_bytes(std::span(name)));
        if (std::string_view(name.data(), name.size()) != kName)
            fail("not a point cache; give a .pc2 file");
        if (file_.size() < kHeadSize) fail("ends within its head; is it complete?");
        file_.read(kName.size(), std::as_writable_bytes(std::span(&head_, 1)));
        if (head_.version != 1) fail(fmt::format("has version {}; only 1 is known", head_.version));
        require_frames();
        if (head_.samples == 0) fail("has no samples; write it again");
        if (head_.points == 0) fail("has no points; write it again");
        // Both numbers are below 2^32, so only the product with 12 bytes may overflow.
        if (head_.samples > (std::uint64_t{1} << 62) / sample_bytes() ||
            file_.size() != kHeadSize + sample_bytes() * head_.samples) {
            fail(
                fmt::format("has {} bytes, but its head tells of {} samples of {} points; is it "
                            "complete?",
                            file_.size(), head_.samples, head_.points));
        }
    }

    std::uint32_t point_count() const { return head_.points; }

    std::vector<double> frames() const {
        std::vector<double> frames(head_.samples);
        for (std::size_t i = 0; i < frames.size(); ++i) frames[i] = frame(i);
        return frames;
    }

    std::optional<Warning> read(std::size_t keyframe, std::span<vec3> out) const {
        file_.read(kHeadSize + sample_bytes() * keyframe, std::as_writable_bytes(out));
        const std::optional<std::string> bad = MeshRules::bad_vertex(out);
        if (!bad) return std::nullopt;
        const std::string what = fmt::format("frame {}: {}", frame(keyframe), *bad);
        if (!lenient_) fail(what + "; repair it", Hint::kLenient);
        return Warning{escape(file_.path()), what + "; kept as it is"};
    }

private:
    double frame(std::size_t sample) const {
        return static_cast<double>(head_.first_frame) +
               static_cast<double>(sample) * static_cast<double>(head_.frames_per_sample);
    }

    std::uint64_t sample_bytes() const {
        static_assert(sizeof(vec3) == 3 * sizeof(float));
        return std::uint64_t{sizeof(vec3)} * head_.points;
    }

    void require_frames() const {
        const double first = frame(0);
        const double step = static_cast<double>(head_.frames_per_sample);
        if (step >= 1 / kMostFrame && std::abs(first) <= kMostFrame &&
            frame(head_.samples) <= kMostFrame)
            return;
        fail(
            fmt::format("has {} samples from frame {} in steps of {}; steps must be above 0, and "
                        "frames within {}",
                        head_.samples, first, step, kMostFrame));
    }

    [[noreturn]] void fail(const std::string& what, Hint hint = Hint::kNone) const {
        throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", escape(file_.path()), what), hint);
    }

    InputFile file_;
    Head head_ = {};
    bool lenient_;
};

}  // namespace

std::unique_ptr<Animation> open_cached(const std::filesystem::path& mesh,
                                       const std::filesystem::path& cache, const std::string& name,
                                       const AnimationOptions& options) {
    FirstMesh first = read_first_mesh(mesh, options);
    const auto source = std::make_shared<const PointCache>(cache, options.lenient);
    if (source->point_count() != first.topology.vertex_count) {
        throw Error(ErrorKind::kBadInput,
                    "{}: has {} points, but {} has {} vertices; give the mesh that the cache was "
                    "written for",
                    escape(cache), source->point_count(), escape(mesh),
                    first.topology.vertex_count);
    }
    first.positions = {};
    // The cache has floats.
    first.origin = {};
    return stream_keyframes(name, std::move(first),
                            {source->frames(), std::bind_front(&PointCache::read, source)},
                            options.warn);
}

}  // namespace mray
