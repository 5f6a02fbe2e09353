#include "common/scene/formats/sequence/keyframe_clip.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <exception>
#include <optional>
#include <vector>

#include "common/base/errors.h"
#include "common/scene/formats/mesh/mesh_file.h"
#include "common/scene/formats/sequence/first_mesh.h"
#include "common/scene/interpolate.h"
#include "common/text/message_text.h"

namespace mray {
namespace {

// Files that are read between checks for errors: enough to keep all cores busy, and few enough to
// refuse a sequence soon that is wrong from its second frame on.
constexpr std::size_t kFilesAtOnce = 64;

struct Keyframe {
    double frame = 0;
    std::vector<vec3> positions;
    WorldBounds bounds;
    /// Why the file cannot be used; empty if it can.
    std::optional<Error> problem;
    std::optional<Warning> warning;
    /// An error that refuses the whole clip.
    std::exception_ptr error;
};

// The first difference between a frame's mesh and that of `first`; empty if they are equal.
std::string difference(const FileMesh& mesh, const Polygons& faces, std::size_t vertex_count,
                       const std::string& first) {
    if (mesh.positions.size() != vertex_count) {
        return fmt::format("{} vertices instead of the {} of {}", mesh.positions.size(),
                           vertex_count, first);
    }
    if (mesh.faces.corner_counts.size() != faces.corner_counts.size()) {
        return fmt::format("{} faces instead of the {} of {}", mesh.faces.corner_counts.size(),
                           faces.corner_counts.size(), first);
    }
    if (mesh.faces == faces) return {};
    std::size_t face = 0;
    std::size_t begin = 0;
    for (; face < faces.corner_counts.size(); ++face) {
        const std::size_t count = faces.corner_counts[face];
        const auto corner = faces.corners.begin() + static_cast<std::ptrdiff_t>(begin);
        if (mesh.faces.corner_counts[face] != count ||
            !std::equal(corner, corner + static_cast<std::ptrdiff_t>(count),
                        mesh.faces.corners.begin() + static_cast<std::ptrdiff_t>(begin))) {
            break;
        }
        begin += count;
    }
    return fmt::format("other vertices in face {} than {}", face + 1, first);
}

// Reads a file other than the first.
void load(const KeyframeFile& file, const FirstMesh& first, const std::filesystem::path& first_path,
          const SceneOptions& options, Keyframe& keyframe) {
    MeshFileOptions positions_only;
    positions_only.lenient = options.lenient;
    positions_only.allow_empty = options.allow_empty;
    positions_only.materials = false;
    positions_only.more_formats = options.more_formats;
    positions_only.warn = [&](const Warning& warning) {
        if (!keyframe.warning) keyframe.warning = warning;
    };
    FileMesh mesh;
    try {
        mesh = read_mesh_file(file.path, positions_only);
    } catch (const Error& error) {
        if (error.kind() != ErrorKind::kBadInput) throw;
        const Warning at = as_warning(error, shown(file.path));
        keyframe.problem.emplace(
            error.kind(),
            fmt::format("{}: frame {}: {}", at.place.empty() ? shown(file.path) : at.place,
                        file.frame, at.text),
            error.remedy());
        return;
    }
    const std::string differs =
        difference(mesh, first.faces, first.topology.vertex_count, shown(first_path));
    if (!differs.empty()) {
        throw Error(ErrorKind::kBadInput,
                    fmt::format("{}: frame {} has {}; all frames of a clip share one topology, "
                                "render sequences that change it in separate runs",
                                shown(file.path), file.frame, differs));
    }
    keyframe.positions = std::move(mesh.positions);
    keyframe.bounds = bounds_of(keyframe.positions);
}

void require_memory(const std::string& name, std::size_t frames, std::size_t vertex_count) {
    const double needed = static_cast<double>(frames) * static_cast<double>(vertex_count) *
                          static_cast<double>(sizeof(vec3));
    const double there =
        static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
    if (needed <= there) return;
    throw Error(ErrorKind::kLimit,
                fmt::format("{}: {} frames of {} vertices need {:.0f} GiB of memory; render the "
                            "sequence in parts",
                            name, frames, vertex_count, needed / 0x1p30));
}

class KeyframeClip : public Clip {
public:
    KeyframeClip(const std::vector<KeyframeFile>& files, const std::string& name,
                 const SceneOptions& options)
        : name_(name), hold_(options.missing == MissingFrames::kHold), keyframes_(files.size()) {
        assert(!files.empty());
        for (std::size_t i = 0; i < files.size(); ++i) keyframes_[i].frame = files[i].frame;
        first_ = read_first_mesh(files[0].path, options);
        require_memory(name, files.size(), first_.positions.size());
        keyframes_[0].positions = std::move(first_.positions);
        keyframes_[0].bounds = bounds_of(keyframes_[0].positions);
        read_others(files, options);
        first_.faces = {};
        for (const Keyframe& keyframe : keyframes_) {
            if (!keyframe.bounds.empty()) {
                bounds_.extend(keyframe.bounds.lower, keyframe.bounds.upper);
            }
        }
    }

    const Topology& topology() const override { return first_.topology; }
    std::span<const uvec3> smooth_corners() const override {
        return first_.smooth.empty() ? first_.topology.triangles : first_.smooth;
    }
    const SceneTextures* textures() const override {
        return first_.textures.files.empty() ? nullptr : &first_.textures;
    }
    double first_frame() const override { return keyframes_.front().frame; }
    double last_frame() const override { return keyframes_.back().frame; }
    WorldBounds bounds() const override { return bounds_; }
    const std::string& name() const override { return name_; }

    void positions(double frame, std::span<vec3> out) const override {
        assert(out.size() == first_.topology.vertex_count);
        const KeyframeBlend blend = blend_at(frame);
        const std::vector<vec3>& a = required(blend.before);
        const std::vector<vec3>& b = required(blend.after);
        if (blend.before == blend.after) {
            std::copy(a.begin(), a.end(), out.begin());
            return;
        }
        for (std::size_t i = 0; i < out.size(); ++i) {
            for (int axis = 0; axis < 3; ++axis) {
                out[i][axis] = interpolate(a[i][axis], b[i][axis], blend.f);
            }
        }
    }

    std::optional<KeyframeBlend> keyframes_at(double frame) const override {
        if (!usable(frame)) return std::nullopt;
        return blend_at(frame);
    }
    std::span<const vec3> keyframe(std::size_t index) const override { return required(index); }

    bool usable(double frame) const override {
        const KeyframeBlend blend = blend_at(frame);
        return !keyframes_[blend.before].problem && !keyframes_[blend.after].problem;
    }
    std::optional<Warning> damage() const override { return damage_; }

private:
    void read_others(const std::vector<KeyframeFile>& files, const SceneOptions& options) {
        WarningCount damage;
        WarningCount warnings;
        for (std::size_t begin = 1; begin < files.size(); begin += kFilesAtOnce) {
            const std::size_t end = std::min(begin + kFilesAtOnce, files.size());
            tbb::parallel_for(begin, end, [&](std::size_t i) {
                try {
                    load(files[i], first_, files[0].path, options, keyframes_[i]);
                } catch (...) {
                    keyframes_[i].error = std::current_exception();
                }
            });
            for (std::size_t i = begin; i < end; ++i) {
                Keyframe& keyframe = keyframes_[i];
                if (keyframe.error) std::rethrow_exception(keyframe.error);
                if (keyframe.problem) {
                    damage.add([&] { return as_warning(*keyframe.problem, shown(files[i].path)); });
                }
                if (keyframe.warning) warnings.add([&] { return *keyframe.warning; });
            }
        }
        if (!damage.none()) damage_ = damage.together();
        warnings.tell(options.warn);
    }

    // The last keyframe at or before a frame of the clip.
    std::size_t at_or_before(double frame) const {
        const auto after =
            std::upper_bound(keyframes_.begin(), keyframes_.end(), frame,
                             [](double f, const Keyframe& keyframe) { return f < keyframe.frame; });
        return static_cast<std::size_t>(after - keyframes_.begin()) - 1;
    }

    KeyframeBlend blend_at(double frame) const {
        // NaN becomes the first frame.
        if (!(frame > first_frame())) frame = first_frame();
        frame = std::min(frame, last_frame());

        const double base = hold_ ? std::floor(frame) : frame;
        const std::size_t before = at_or_before(base);
        const std::size_t after =
            hold_ ? at_or_before(base + 1) : std::min(before + 1, keyframes_.size() - 1);
        const double from = hold_ ? base : keyframes_[before].frame;
        const double to = hold_ ? base + 1 : keyframes_[after].frame;
        const float f = frame == from ? 0.0f : static_cast<float>((frame - from) / (to - from));
        if (f == 0.0f || before == after) return {before, before, 0.0f};
        // Closer to the next keyframe than a float can tell.
        if (f == 1.0f) return {after, after, 0.0f};
        return {before, after, f};
    }

    const std::vector<vec3>& required(std::size_t keyframe) const {
        if (keyframes_[keyframe].problem) throw Error(*keyframes_[keyframe].problem);
        return keyframes_[keyframe].positions;
    }

    std::string name_;
    bool hold_;
    /// Without positions and faces.
    FirstMesh first_;
    std::vector<Keyframe> keyframes_;
    WorldBounds bounds_;
    std::optional<Warning> damage_;
};

}  // namespace

std::unique_ptr<Clip> open_keyframes(const std::vector<KeyframeFile>& files,
                                     const std::string& name, const SceneOptions& options) {
    return std::make_unique<KeyframeClip>(files, name, options);
}

}  // namespace mray
