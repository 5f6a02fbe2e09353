#include "common/scene/formats/point_cache/cached_clip.h"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/warning_count.h"
#include "common/scene/formats/mesh/mesh_rules.h"
#include "common/scene/formats/point_cache/point_cache.h"
#include "common/scene/formats/sequence/first_mesh.h"
#include "common/scene/interpolate.h"
#include "common/text/message_text.h"

namespace mray {
namespace {

/// A coordinate that is not finite or too large.
struct BadCoordinate {
    std::size_t vertex = 0;
    float value = 0;
};

std::optional<BadCoordinate> first_bad(std::span<const vec3> positions) {
    if (MeshRules::are_good(positions)) return std::nullopt;
    for (std::size_t i = 0; i < positions.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            if (!MeshRules::is_good(positions[i][axis]))
                return BadCoordinate{i, positions[i][axis]};
        }
    }
    return std::nullopt;
}

class CachedClip : public Clip {
public:
    CachedClip(const std::filesystem::path& mesh, const std::filesystem::path& cache,
               const std::string& name, const SceneOptions& options)
        : name_(name), first_(read_first_mesh(mesh, options)), cache_(cache) {
        if (cache_.point_count() != first_.topology.vertex_count) {
            throw Error(ErrorKind::kBadInput,
                        fmt::format("{}: has {} points, but {} has {} vertices; give the mesh that "
                                    "the cache was written for",
                                    shown(cache), cache_.point_count(), shown(mesh),
                                    first_.topology.vertex_count));
        }
        first_.faces = {};
        first_.positions = {};
        scan(options);
    }

    const Topology& topology() const override { return first_.topology; }
    std::span<const uvec3> smooth_corners() const override {
        return first_.smooth.empty() ? first_.topology.triangles : first_.smooth;
    }
    const SceneTextures* textures() const override {
        return first_.textures.files.empty() ? nullptr : &first_.textures;
    }
    double first_frame() const override { return cache_.frame(0); }
    double last_frame() const override { return cache_.frame(cache_.sample_count() - 1); }
    WorldBounds bounds() const override { return bounds_; }
    const std::string& name() const override { return name_; }

    void positions(double frame, std::span<vec3> out) const override {
        assert(out.size() == first_.topology.vertex_count);
        const KeyframeBlend blend = blend_at(frame);
        read(blend.before, out);
        if (blend.before == blend.after) return;
        std::vector<vec3> after(out.size());
        read(blend.after, after);
        for (std::size_t i = 0; i < out.size(); ++i) {
            for (int axis = 0; axis < 3; ++axis)
                out[i][axis] = interpolate(out[i][axis], after[i][axis], blend.f);
        }
    }

    bool usable(double frame) const override {
        const KeyframeBlend blend = blend_at(frame);
        return !damaged_.contains(blend.before) && !damaged_.contains(blend.after);
    }
    std::optional<Warning> damage() const override { return damage_; }

private:
    /// Finds the bounds, and the samples that cannot be used.
    void scan(const SceneOptions& options) {
        tbb::enumerable_thread_specific<std::vector<vec3>> buffers(cache_.point_count());
        std::map<std::size_t, BadCoordinate> bad;
        std::mutex mutex;
        tbb::parallel_for(std::size_t{0}, cache_.sample_count(), [&](std::size_t sample) {
            std::vector<vec3>& positions = buffers.local();
            cache_.read(sample, positions);
            const std::optional<BadCoordinate> found = first_bad(positions);
            const WorldBounds bounds = bounds_of(positions);
            const std::scoped_lock lock(mutex);
            if (found) bad.emplace(sample, *found);
            if ((!found || options.lenient) && !bounds.empty())
                bounds_.extend(bounds.lower, bounds.upper);
        });
        if (bad.empty()) return;
        if (!options.lenient && bad.size() == cache_.sample_count()) throw problem(*bad.begin());
        WarningCount count;
        for (const auto& entry : bad) {
            count.add([&] { return as_warning(problem(entry), shown(cache_.path())); });
        }
        if (options.lenient) {
            Warning kept = count.together();
            kept.remedy = Remedy::kNone;
            if (options.warn) options.warn(kept);
            return;
        }
        damage_ = count.together();
        damaged_ = std::move(bad);
    }

    Error problem(const std::pair<const std::size_t, BadCoordinate>& bad) const {
        const auto& [sample, at] = bad;
        return {ErrorKind::kBadInput,
                fmt::format("{}: frame {}: vertex {} has a coordinate that {}",
                            shown(cache_.path()), cache_.frame(sample), at.vertex,
                            std::isfinite(at.value) ? "is beyond 1e30" : "is not finite"),
                Remedy::kLenient};
    }

    void read(std::size_t sample, std::span<vec3> out) const {
        const auto damaged = damaged_.find(sample);
        if (damaged != damaged_.end()) throw problem(*damaged);
        cache_.read(sample, out);
    }

    KeyframeBlend blend_at(double frame) const {
        const std::size_t last = cache_.sample_count() - 1;
        // NaN becomes the first frame.
        if (!(frame > first_frame())) return {0, 0, 0.0f};
        if (frame >= last_frame()) return {last, last, 0.0f};
        const double step = cache_.frame(1) - cache_.frame(0);
        std::size_t before =
            std::min(static_cast<std::size_t>((frame - first_frame()) / step), last - 1);
        // The quotient may be rounded to the neighbour.
        while (cache_.frame(before) > frame) --before;
        while (before + 1 < last && cache_.frame(before + 1) <= frame) ++before;
        const double from = cache_.frame(before);
        const double to = cache_.frame(before + 1);
        const float f = frame == from ? 0.0f : static_cast<float>((frame - from) / (to - from));
        if (f == 0.0f) return {before, before, 0.0f};
        // Closer to the next sample than a float can tell.
        if (f >= 1.0f) return {before + 1, before + 1, 0.0f};
        return {before, before + 1, f};
    }

    std::string name_;
    /// Without positions and faces.
    FirstMesh first_;
    PointCache cache_;
    WorldBounds bounds_;
    std::map<std::size_t, BadCoordinate> damaged_;
    std::optional<Warning> damage_;
};

}  // namespace

std::unique_ptr<Clip> open_cached(const std::filesystem::path& mesh,
                                  const std::filesystem::path& cache, const std::string& name,
                                  const SceneOptions& options) {
    return std::make_unique<CachedClip>(mesh, cache, name, options);
}

}  // namespace mray
