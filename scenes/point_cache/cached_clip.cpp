#include "scenes/point_cache/cached_clip.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/errors.h"
#include "common/text/message_text.h"
#include "scenes/keyframes/first_mesh.h"
#include "scenes/keyframes/streamed_clip.h"
#include "scenes/mesh/mesh_rules.h"
#include "scenes/point_cache/point_cache.h"

namespace mray {
namespace {

bool is_ordinary(vec3 p) {
    const auto fits = [](float x) { return std::abs(x) <= kMaxCoordinate; };
    return fits(p.x) && fits(p.y) && fits(p.z);
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
        const auto bad = std::ranges::find_if_not(out, is_ordinary);
        if (bad == out.end()) return std::nullopt;
        const std::string place = shown(cache_.path());
        const std::string what =
            fmt::format("frame {}: vertex {} has a coordinate that is not finite or beyond 1e30",
                        frame(keyframe), bad - out.begin());
        if (lenient_) return Warning{place, what + "; kept as it is"};
        throw Error(ErrorKind::kBadInput, fmt::format("{}: {}; repair it", place, what),
                    Remedy::kLenient);
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
