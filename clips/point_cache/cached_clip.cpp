#include "clips/point_cache/cached_clip.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "clips/keyframes/first_mesh.h"
#include "clips/keyframes/measure_positions.h"
#include "clips/keyframes/streamed_clip.h"
#include "clips/point_cache/point_cache.h"
#include "common/base/errors.h"
#include "common/text/message_text.h"

namespace mray {
namespace {

class CacheSource : public KeyframeSource {
public:
    CacheSource(const std::filesystem::path& cache, bool lenient)
        : cache_(cache), lenient_(lenient) {}

    std::uint32_t point_count() const { return cache_.point_count(); }

    std::size_t count() const override { return cache_.sample_count(); }
    double frame(std::size_t keyframe) const override { return cache_.frame(keyframe); }
    const std::filesystem::path& file(std::size_t) const override { return cache_.path(); }

    KeyframeNotes read(std::size_t keyframe, std::span<vec3> out) const override {
        cache_.read(keyframe, out);
        const std::optional<BadCoordinate> bad = measure_positions(out).bad;
        if (!bad) return {};
        const std::string place = shown(cache_.path());
        const std::string what = fmt::format(
            "frame {}: vertex {} has a coordinate that {}", frame(keyframe), bad->vertex,
            std::isfinite(bad->value) ? "is beyond 1e30" : "is not finite");
        if (lenient_) return {.warning = Warning{place, what + "; kept as it is"}};
        return {.problem = Error(ErrorKind::kBadInput,
                                 fmt::format("{}: {}; repair it", place, what), Remedy::kLenient)};
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
                                shown(cache), source->point_count(), shown(mesh),
                                first.topology.vertex_count));
    }
    return stream_keyframes({.name = name, .first = std::move(first)}, std::move(source), options);
}

}  // namespace mray
