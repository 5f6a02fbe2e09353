#include "scenes/sequence/streamed_animation.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <iterator>
#include <map>
#include <mutex>

#include "common/text/text.h"
#include "scenes/obj/obj_reader.h"
#include "scenes/ply/ply_reader.h"

namespace mray {
namespace {

/// Gives triangles what the file says of their faces and their corners, indices in mesh.faces.
void set_appearance(const FileMesh& mesh, std::span<const uvec3> corners, FirstMesh& first) {
    SceneTextures& textures = first.textures;
    textures.files = mesh.textures;
    for (const uvec3& t : corners) {
        if (!mesh.smooth.empty())
            first.smooth.emplace_back(mesh.smooth[t.x], mesh.smooth[t.y], mesh.smooth[t.z]);
        if (!mesh.textures.empty())
            textures.texcoords.push_back(
                {mesh.texcoords[t.x], mesh.texcoords[t.y], mesh.texcoords[t.z]});
    }
    Topology& topology = first.topology;
    const auto for_triangles = [&](const auto& of_faces, auto& of_triangles) {
        for (std::size_t face = 0; face < of_faces.size(); ++face)
            of_triangles.insert(of_triangles.end(), mesh.faces.corner_counts[face] - 2,
                                of_faces[face]);
    };
    for_triangles(mesh.face_textures, textures.texture_ids);
    for_triangles(mesh.albedo, topology.albedo);
    topology.albedo.resize(topology.triangles.size(), kClay);
    const std::vector<vec3>& colours = mesh.vertex_colours;
    for (std::size_t i = 0; !colours.empty() && i < topology.triangles.size(); ++i) {
        if (topology.albedo[i] != kClay) continue;
        const uvec3& t = topology.triangles[i];
        const vec3 mean = (colours[t.x] + colours[t.y] + colours[t.z]) / 3.0f;
        topology.albedo[i] = albedo_of(mean.x, mean.y, mean.z);
    }
}

/// The positions of a keyframe, in world space.
using KeyframePositions = std::shared_ptr<const std::vector<vec3>>;

/// Keeps keyframes up to 128 MiB, else the last one and its neighbour. Threads may share it.
class KeyframeCache {
public:
    KeyframeCache(std::size_t keyframe_count, std::size_t vertex_count)
        : keeps_all_(vertex_count == 0 ||
                     keyframe_count <= kResidentBytes / (vertex_count * sizeof(vec3))) {}

    /// The positions of a keyframe; null if they are not here.
    KeyframePositions find(std::size_t keyframe) const {
        const std::scoped_lock lock(mutex_);
        const auto found = entries_.find(keyframe);
        return found == entries_.end() ? nullptr : found->second;
    }

    void add(std::size_t keyframe, KeyframePositions positions) {
        const std::scoped_lock lock(mutex_);
        entries_.insert_or_assign(keyframe, std::move(positions));
        if (keeps_all_ || entries_.size() <= kFew) return;
        const auto first = entries_.begin();
        const auto last = std::prev(entries_.end());
        entries_.erase(keyframe - first->first > last->first - keyframe ? first : last);
    }

    /// Whether nothing that is added is removed again.
    bool keeps_all() const { return keeps_all_; }

private:
    static constexpr std::size_t kResidentBytes = std::size_t{128} << 20;
    static constexpr std::size_t kFew = 2;

    bool keeps_all_;
    mutable std::mutex mutex_;
    std::map<std::size_t, KeyframePositions> entries_;
};

class StreamedAnimation : public Animation {
public:
    StreamedAnimation(const std::string& name, FirstMesh first, Keyframes keyframes,
                      const WarnFunction& warn)
        : Animation(name),
          smooth_(std::move(first.smooth)),
          keyframes_(std::move(keyframes)),
          warn_(warn),
          cache_(keyframes_.frames.size(), first.topology.vertex_count) {
        topology_ = std::move(first.topology);
        smooth_corners_ = smooth_.empty() ? topology_.triangles : smooth_;
        textures_ = std::move(first.textures);
        origin_ = first.origin;
        first_frame_ = keyframes_.frames.front();
        last_frame_ = keyframes_.frames.back();
        if (!first.positions.empty())
            cache_.add(0, std::make_shared<std::vector<vec3>>(std::move(first.positions)));
        set_bounds(*keyframe(0));
    }

    void positions(double frame, std::span<vec3> out) const override {
        assert(out.size() == topology().vertex_count);
        // NaN becomes the first frame.
        if (!(frame > first_frame())) frame = first_frame();
        frame = std::min(frame, last_frame());
        const std::vector<double>& frames = keyframes_.frames;
        const auto after = std::ranges::upper_bound(frames, frame);
        const auto before = static_cast<std::size_t>(after - frames.begin()) - 1;
        const double from = frames[before];
        if (frame == from) return copy_keyframe(before, out);
        const auto f = static_cast<float>((frame - from) / (*after - from));
        // Closer to a keyframe than a float can distinguish.
        if (f == 0.0f) return copy_keyframe(before, out);
        if (f >= 1.0f) return copy_keyframe(before + 1, out);
        const KeyframePositions a = keyframe(before);
        const KeyframePositions b = keyframe(before + 1);
        for (std::size_t i = 0; i < out.size(); ++i) {
            for (int axis = 0; axis < 3; ++axis)
                out[i][axis] = interpolate((*a)[i][axis], (*b)[i][axis], f);
        }
    }

private:
    KeyframePositions keyframe(std::size_t index) const {
        if (KeyframePositions kept = cache_.find(index)) return kept;
        auto positions = std::make_shared<std::vector<vec3>>(topology().vertex_count);
        read(index, *positions);
        cache_.add(index, positions);
        return positions;
    }

    void copy_keyframe(std::size_t index, std::span<vec3> out) const {
        const KeyframePositions kept = cache_.keeps_all() ? keyframe(index) : cache_.find(index);
        if (kept == nullptr) return read(index, out);
        std::ranges::copy(*kept, out.begin());
    }

    void read(std::size_t keyframe, std::span<vec3> out) const {
        const std::optional<Warning> warning = keyframes_.read(keyframe, out);
        if (!warning || !warn_) return;
        const std::scoped_lock lock(warn_mutex_);
        warn_(*warning);
    }

    std::vector<uvec3> smooth_;
    Keyframes keyframes_;
    WarnFunction warn_;
    mutable KeyframeCache cache_;
    mutable std::mutex warn_mutex_;
};

/// By the format of its name, else as OBJ. Throws Error: kBadInput with the place, kLimit.
FileMesh read_mesh_file(const std::filesystem::path& path, const MeshFileOptions& options) {
    return lower_case(path.extension().native()) == ".ply" ? read_ply(path, options)
                                                           : read_obj(path, options);
}

std::uint64_t hash_of_faces(const Polygons& faces) {
    return Hasher().add(faces.corners).add(faces.corner_counts).digest();
}

/// Reads keyframes from files of one topology.
class KeyframeFiles {
public:
    KeyframeFiles(std::vector<KeyframeFile> files, const FirstMesh& first,
                  const AnimationOptions& options)
        : files_(std::move(files)),
          vertex_count_(first.positions.size()),
          face_count_(first.faces.corner_counts.size()),
          faces_hash_(hash_of_faces(first.faces)),
          origin_(first.origin),
          is_lenient_(options.lenient) {}

    std::optional<Warning> read(std::size_t keyframe, std::span<vec3> out) const {
        const KeyframeFile& file = files_[keyframe];
        std::optional<Warning> first_warning;
        const WarnFunction warn = [&](const Warning& warning) {
            if (!first_warning) first_warning = warning;
        };
        FileMesh mesh;
        try {
            mesh = read_mesh_file(
                file.path,
                {.lenient = is_lenient_, .positions_only = true, .origin = origin_, .warn = warn});
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::kBadInput) throw;
            const Warning at = as_warning(error, escape(file.path));
            throw Error(
                error.kind(),
                fmt::format("{}: frame {}: {}", at.place.empty() ? escape(file.path) : at.place,
                            file.frame, at.text),
                error.hint());
        }
        if (mesh.positions.size() != vertex_count_ || hash_of_faces(mesh.faces) != faces_hash_) {
            throw Error(ErrorKind::kBadInput,
                        "{}: frame {} has other faces ({} of {} vertices) than {} ({} of {}); all "
                        "frames of an animation share one topology, render sequences that change "
                        "it in separate runs",
                        escape(file.path), file.frame, mesh.faces.corner_counts.size(),
                        mesh.positions.size(), escape(files_.front().path), face_count_,
                        vertex_count_);
        }
        std::ranges::copy(mesh.positions, out.begin());
        if (mesh.is_coarse && !was_coarse_.exchange(true))
            warn({escape(file.path),
                  fmt::format("frame {} lies so far from the first that rounding to float moves "
                              "vertices by more than 1e-6 of its size",
                              file.frame)});
        return first_warning;
    }

private:
    std::vector<KeyframeFile> files_;
    std::size_t vertex_count_, face_count_;
    std::uint64_t faces_hash_;
    Origin origin_;
    bool is_lenient_;
    mutable std::atomic<bool> was_coarse_ = false;
};

}  // namespace

FirstMesh read_first_mesh(const std::filesystem::path& path, const AnimationOptions& options) {
    FileMesh mesh = read_mesh_file(path, {.lenient = options.lenient, .warn = options.warn});
    FirstMesh first;
    Topology& topology = first.topology;
    topology.vertex_count = static_cast<std::uint32_t>(mesh.positions.size());
    const bool has_corners = !mesh.smooth.empty() || !mesh.textures.empty();
    std::vector<uvec3> corners;
    std::vector<std::size_t> crossing;
    topology.triangles =
        triangulate(mesh.faces, mesh.positions, has_corners ? &corners : nullptr, &crossing);
    WarningCount warnings;
    for (const std::size_t polygon : crossing) {
        warnings.add(fmt::format("{}{}", mesh.place_prefix, mesh.polygon_places[polygon]),
                     "face crosses itself or has too many corners; its triangles may lie outside; "
                     "repair it");
    }
    warnings.tell(options.warn);
    set_appearance(mesh, corners, first);
    first.faces = std::move(mesh.faces);
    first.origin = mesh.origin;
    first.positions = std::move(mesh.positions);
    return first;
}

std::unique_ptr<Animation> stream_keyframes(const std::string& name, FirstMesh first,
                                            Keyframes keyframes, const WarnFunction& warn) {
    return std::make_unique<StreamedAnimation>(name, std::move(first), std::move(keyframes), warn);
}

std::unique_ptr<Animation> open_keyframes(const std::vector<KeyframeFile>& files,
                                          const std::string& name,
                                          const AnimationOptions& options) {
    assert(!files.empty());
    FirstMesh first = read_first_mesh(files[0].path, options);
    const auto source = std::make_shared<const KeyframeFiles>(files, first, options);
    Keyframes keyframes = {.read = std::bind_front(&KeyframeFiles::read, source)};
    for (const KeyframeFile& file : files) keyframes.frames.push_back(file.frame);
    return stream_keyframes(name, std::move(first), std::move(keyframes), options.warn);
}

}  // namespace mray
