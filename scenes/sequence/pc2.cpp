#include "scenes/sequence/pc2.h"

#include <fmt/format.h>

#include <bit>

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
    char name[kName.size()];
    std::uint32_t version, points;
    float first_frame, frames_per_sample;
    std::uint32_t samples;
};

class PointCache {
public:
    /// Throws Error(kBadInput) for another file, another size than the head says, or no samples.
    PointCache(const std::filesystem::path& path, bool lenient) : file_(path), lenient_(lenient) {
        static_assert(std::endian::native == std::endian::little);
        if (file_.size() >= sizeof(Head))
            file_.read(0, std::as_writable_bytes(std::span(&head_, 1)));
        if (std::string_view(head_.name, kName.size()) != kName)
            fail("not a point cache; give a complete .pc2 file");
        const double step = static_cast<double>(head_.frames_per_sample);
        if (head_.version != 1 || head_.points == 0 || head_.samples == 0 ||
            !(step >= 1 / kMostFrame && std::abs(frame(0)) <= kMostFrame &&
              frame(head_.samples) <= kMostFrame)) {
            fail(
                "has version {}, {} points, and {} samples from frame {} in steps of {}; must have "
                "version 1, points and samples, and steps above 0 to frames within {}",
                head_.version, head_.points, head_.samples, frame(0), step, kMostFrame);
        }
        // Both numbers are below 2^32, so only the product with 12 bytes may overflow.
        if (head_.samples > (std::uint64_t{1} << 62) / sample_bytes() ||
            file_.size() != sizeof(Head) + sample_bytes() * head_.samples) {
            fail("has {} bytes, but its head tells of {} samples of {} points; is it complete?",
                 file_.size(), head_.samples, head_.points);
        }
    }

    std::uint32_t point_count() const { return head_.points; }

    std::vector<double> frames() const {
        std::vector<double> frames(head_.samples);
        for (std::size_t i = 0; i < frames.size(); ++i) frames[i] = frame(i);
        return frames;
    }

    std::optional<Warning> read(std::size_t keyframe, std::span<vec3> out) const {
        file_.read(sizeof(Head) + sample_bytes() * keyframe, std::as_writable_bytes(out));
        return MeshRules::check_frame(escape(file_.path()), frame(keyframe), out, lenient_);
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

    template <class... Values>
    [[noreturn]] void fail(fmt::format_string<Values...> what, Values&&... values) const {
        throw Error(ErrorKind::kBadInput, "{}: {}", escape(file_.path()),
                    fmt::format(what, std::forward<Values>(values)...));
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
