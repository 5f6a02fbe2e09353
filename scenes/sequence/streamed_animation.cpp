#include "scenes/sequence/streamed_animation.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <iterator>
#include <map>
#include <mutex>
#include <numeric>

#include "common/base/input_file.h"
#include "common/text/text.h"
#include "scenes/obj/obj_reader.h"
#include "scenes/ply/ply_reader.h"

namespace mray {
namespace {

std::string extension_of(const std::filesystem::path& path) {
    return lower_case(path.extension().native());
}

/// Gives triangles the smooth numbers and textures of their corners, indices in mesh.faces.
void set_corners(const FileMesh& mesh, std::span<const uvec3> corners, std::vector<uvec3>& smooth,
                 SceneTextures& textures) {
    if (!mesh.smooth.empty()) {
        smooth.reserve(corners.size());
        for (const uvec3& t : corners)
            smooth.emplace_back(mesh.smooth[t.x], mesh.smooth[t.y], mesh.smooth[t.z]);
    }
    if (mesh.textures.empty()) return;
    textures.files = mesh.textures;
    textures.texcoords.reserve(corners.size());
    for (const uvec3& t : corners)
        textures.texcoords.push_back(
            {mesh.texcoords[t.x], mesh.texcoords[t.y], mesh.texcoords[t.z]});
    textures.texture_ids.reserve(corners.size());
    for (std::size_t face = 0; face < mesh.face_textures.size(); ++face) {
        textures.texture_ids.insert(textures.texture_ids.end(), mesh.faces.corner_counts[face] - 2,
                                    mesh.face_textures[face]);
    }
}

void set_albedo(const FileMesh& mesh, Topology& topology) {
    topology.albedo.reserve(topology.triangles.size());
    for (std::size_t face = 0; face < mesh.albedo.size(); ++face) {
        topology.albedo.insert(topology.albedo.end(), mesh.faces.corner_counts[face] - 2,
                               mesh.albedo[face]);
    }
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
    StreamedAnimation(const std::string& name, FirstMesh first,
                      std::unique_ptr<KeyframeSource> source, const WarnFunction& warn)
        : name_(name),
          first_(std::move(first)),
          source_(std::move(source)),
          warn_(warn),
          cache_(source_->count(), topology().vertex_count) {
        first_.faces = {};
        std::vector<vec3> positions = std::exchange(first_.positions, {});
        if (!positions.empty())
            cache_.add(0, std::make_shared<std::vector<vec3>>(std::move(positions)));
        bounds_ = reference_bounds(topology(), *keyframe(0));
    }

    const Topology& topology() const override { return first_.topology; }
    std::span<const uvec3> smooth_corners() const override {
        return first_.smooth.empty() ? topology().triangles : first_.smooth;
    }
    const SceneTextures* textures() const override {
        return first_.textures.files.empty() ? nullptr : &first_.textures;
    }
    double first_frame() const override { return source_->frame(0); }
    double last_frame() const override { return source_->frame(source_->count() - 1); }
    Origin origin() const override { return first_.origin; }
    WorldBounds bounds() const override { return bounds_; }
    const std::string& name() const override { return name_; }

    void positions(double frame, std::span<vec3> out) const override {
        assert(out.size() == topology().vertex_count);
        // NaN becomes the first frame.
        if (!(frame > first_frame())) frame = first_frame();
        frame = std::min(frame, last_frame());
        const std::size_t before = at_or_before(frame);
        const double from = source_->frame(before);
        if (frame == from) return copy_keyframe(before, out);
        const double step = source_->frame(before + 1) - from;
        const auto f = static_cast<float>((frame - from) / step);
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
        const std::optional<Warning> warning = source_->read(keyframe, out);
        if (!warning || !warn_) return;
        const std::scoped_lock lock(warn_mutex_);
        warn_(*warning);
    }

    /// The last keyframe at or before a frame of the animation.
    std::size_t at_or_before(double frame) const {
        std::size_t first = 0;
        std::size_t count = source_->count();
        while (count > 1) {
            const std::size_t half = count / 2;
            const bool is_later = source_->frame(first + half) > frame;
            if (!is_later) first += half;
            count = is_later ? half : count - half;
        }
        return first;
    }

    const std::string name_;
    FirstMesh first_;
    std::unique_ptr<KeyframeSource> source_;
    WarnFunction warn_;
    mutable KeyframeCache cache_;
    WorldBounds bounds_;
    mutable std::mutex warn_mutex_;
};

/// By the format of its name, else as OBJ. Throws Error: kBadInput with the place, kLimit.
FileMesh read_mesh_file(const std::filesystem::path& path, const MeshFileOptions& options) {
    return extension_of(path) == ".ply" ? read_ply(path, options) : read_obj(path, options);
}

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
                     "face crosses itself; its triangles may lie outside; repair it");
    }
    warnings.tell(options.warn);
    set_corners(mesh, corners, first.smooth, first.textures);
    set_albedo(mesh, topology);
    first.faces = std::move(mesh.faces);
    first.origin = mesh.origin;
    first.positions = std::move(mesh.positions);
    return first;
}

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

/// A PC2 file (Autodesk 3ds Max, Blender), each sample of which is a keyframe.
class CacheSource : public KeyframeSource {
public:
    /// Throws Error(kBadInput) for another file, another size than the head says, or no samples.
    CacheSource(const std::filesystem::path& path, bool lenient) : file_(path), lenient_(lenient) {
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

    std::size_t count() const override { return head_.samples; }
    double frame(std::size_t keyframe) const override {
        return static_cast<double>(head_.first_frame) +
               static_cast<double>(keyframe) * static_cast<double>(head_.frames_per_sample);
    }

    std::optional<Warning> read(std::size_t keyframe, std::span<vec3> out) const override {
        file_.read(kHeadSize + sample_bytes() * keyframe, std::as_writable_bytes(out));
        const auto bad =
            std::ranges::find_if_not(out, [](const vec3& p) { return MeshRules::is_good(p); });
        if (bad == out.end()) return std::nullopt;
        const std::string what =
            fmt::format("frame {}: vertex {} has a coordinate that is not finite or beyond 1e30",
                        frame(keyframe), bad - out.begin());
        if (!lenient_) fail(what + "; repair it", Hint::kLenient);
        return Warning{escape(file_.path()), what + "; kept as it is"};
    }

private:
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

namespace fs = std::filesystem;

constexpr std::string_view kDigits = "0123456789";
constexpr std::size_t kMostDigits = 18;

/// The names of a sequence: a number between two texts.
struct Pattern {
    std::string prefix;
    std::string suffix = {};
};

struct NumberedName {
    std::string name;
    std::size_t digits = 0;
    std::uint64_t number = 0;
};

[[noreturn]] void fail_at(const fs::path& path, const std::string& what, Hint hint = Hint::kNone) {
    throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", escape(path), what), hint);
}

std::vector<std::string> file_names(const fs::path& folder) {
    std::vector<std::string> names;
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
        std::error_code ignored;
        if (!entry->is_directory(ignored)) names.push_back(entry->path().filename().native());
    }
    if (error == std::errc::not_enough_memory) throw std::bad_alloc();
    if (error)
        fail_at(folder, fmt::format("folder cannot be read: {}; check the path", error.message()));
    // A folder lists its files in an order of the file system.
    std::sort(names.begin(), names.end());
    return names;
}

/// The pattern of a name, by the last number before its ending; a name without one is all prefix.
Pattern pattern_of(const std::string& name) {
    const std::size_t last = name.find_last_of(kDigits, name.rfind('.'));
    if (last == std::string::npos) return {name};
    const std::size_t before = name.find_last_not_of(kDigits, last);
    return {name.substr(0, before + 1), name.substr(last + 1)};  // npos + 1 is 0
}

/// Nothing for a name that does not match.
std::optional<NumberedName> numbered(const std::string& name, const Pattern& pattern) {
    const std::size_t around = pattern.prefix.size() + pattern.suffix.size();
    if (name.size() <= around || name.size() - around > kMostDigits ||
        !name.starts_with(pattern.prefix) || !name.ends_with(pattern.suffix))
        return std::nullopt;
    const std::string digits = name.substr(pattern.prefix.size(), name.size() - around);
    const auto number = parse_unsigned(digits);
    return number ? std::optional(NumberedName{name, digits.size(), *number}) : std::nullopt;
}

/// Number `first` is frame 0, and the next frame is `step` numbers on. Reports missing ones.
std::vector<KeyframeFile> numbered_files(const fs::path& folder, const Pattern& pattern,
                                         const std::vector<NumberedName>& names,
                                         std::uint64_t first, std::uint64_t step,
                                         const AnimationOptions& options) {
    std::vector<KeyframeFile> files;
    std::string first_missing;
    for (std::size_t i = 0; i < names.size(); ++i) {
        files.push_back(
            {static_cast<double>((names[i].number - first) / step), folder / names[i].name});
        if (i == 0) continue;
        const NumberedName& before = names[i - 1];
        if (names[i].number == before.number) {
            fail_at(folder, fmt::format("{} and {} are the same frame; remove one",
                                        escape(before.name), escape(names[i].name)));
        }
        if (first_missing.empty() && names[i].number - before.number > step) {
            first_missing = fmt::format("{}{:0{}}{}", pattern.prefix, before.number + step,
                                        before.digits, pattern.suffix);
        }
    }
    if (first_missing.empty()) return files;
    const double missing =
        files.back().frame - files.front().frame + 1 - static_cast<double>(files.size());
    const std::string more = missing > 1 ? fmt::format(" and {} more", missing - 1) : "";
    if (!options.skip_missing) {
        fail_at(folder / first_missing, fmt::format("frame is missing{}; add it", more),
                Hint::kReplaceMissing);
    }
    if (options.warn) {
        options.warn({escape(folder / first_missing),
                      fmt::format("frame is missing{}; its neighbours are interpolated", more)});
    }
    return files;
}

[[noreturn]] void refuse_pattern(const std::string& pattern, const char* what) {
    throw Error(ErrorKind::kBadArgument,
                "pattern {}: {}; write one %d, %0Nd (N from 1 to 9) or * in the file name",
                quote(pattern), what);
}

Pattern split_pattern(const std::string& pattern) {
    const std::size_t name_at = pattern.rfind('/') + 1;  // npos + 1 is 0
    const std::size_t mark = pattern.find_first_of("%*", name_at);
    if (mark == std::string::npos) refuse_pattern(pattern, "no frame number in the file's name");
    std::size_t end = mark + 1;
    if (pattern[mark] == '%') {
        const std::string_view rest = std::string_view(pattern).substr(end);
        const bool is_padded = rest.size() >= 3 && rest[0] == '0' && rest[1] >= '1' &&
                               rest[1] <= '9' && rest[2] == 'd';
        if (!is_padded && !rest.starts_with('d')) refuse_pattern(pattern, "unknown use of '%'");
        end += is_padded ? 3 : 1;
    }
    if (pattern.find_first_of("%*", end) != std::string::npos)
        refuse_pattern(pattern, "two frame numbers");
    return {pattern.substr(name_at, mark - name_at), pattern.substr(end)};
}

std::uint64_t hash_of_faces(const Polygons& faces) {
    return Hasher().add(faces.corners).add(faces.corner_counts).digest();
}

class FileSource : public KeyframeSource {
public:
    FileSource(std::vector<KeyframeFile> files, const FirstMesh& first,
               const AnimationOptions& options)
        : files_(std::move(files)),
          vertex_count_(first.positions.size()),
          face_count_(first.faces.corner_counts.size()),
          faces_hash_(hash_of_faces(first.faces)),
          origin_(first.origin),
          is_lenient_(options.lenient) {}

    std::size_t count() const override { return files_.size(); }
    double frame(std::size_t keyframe) const override { return files_[keyframe].frame; }
    std::optional<Warning> read(std::size_t keyframe, std::span<vec3> out) const override {
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
        if (mesh.is_coarse && !first_warning && !was_coarse_.exchange(true)) {
            first_warning = {escape(file.path),
                             fmt::format("frame {} lies so far from the first that rounding to "
                                         "float moves vertices by more than 1e-6 of its size",
                                         file.frame)};
        }
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

bool has_mesh_name(const std::filesystem::path& path) {
    const std::string extension = extension_of(path);
    return extension == ".obj" || extension == ".ply";
}

std::unique_ptr<Animation> stream_keyframes(const std::string& name, FirstMesh first,
                                            std::unique_ptr<KeyframeSource> source,
                                            const WarnFunction& warn) {
    return std::make_unique<StreamedAnimation>(name, std::move(first), std::move(source), warn);
}

std::vector<KeyframeFile> files_of_folder(const fs::path& folder, const AnimationOptions& options,
                                          const std::string& prefix, const std::string& suffix) {
    std::vector<std::string> all = file_names(folder);
    std::erase_if(all, [&](const auto& name) {
        return name[0] == '.' || !has_mesh_name(name) || !name.starts_with(prefix) ||
               !name.ends_with(suffix);
    });
    if (all.empty())
        fail_at(folder / (prefix + '*' + suffix),
                "no .obj or .ply file of this name; check the path");
    const Pattern pattern = pattern_of(all[0]);
    std::vector<NumberedName> names;
    for (const std::string& name : all) {
        const std::optional<NumberedName> file = numbered(name, pattern);
        if (!file && name != all[0]) {
            fail_at(folder, fmt::format("{} and {} are not frames of one sequence; give a pattern "
                                        "such as frame_%04d.obj, or one file",
                                        escape(all[0]), escape(name)));
        }
        names.push_back(file.value_or(NumberedName{name}));
    }
    std::ranges::stable_sort(names, {}, &NumberedName::number);
    const std::uint64_t first = names[0].number;
    std::uint64_t step = 0;
    for (const NumberedName& name : names) step = std::gcd(step, name.number - first);
    return numbered_files(folder, pattern, names, first, std::max<std::uint64_t>(step, 1), options);
}

std::vector<KeyframeFile> files_of_pattern(const std::string& text,
                                           const AnimationOptions& options) {
    const Pattern pattern = split_pattern(text);
    const fs::path folder = fs::path(text).parent_path();
    std::vector<NumberedName> names;
    for (const std::string& name : file_names(folder.empty() ? "." : folder))
        if (const auto file = numbered(name, pattern)) names.push_back(*file);
    // A star also stands for more than a number, as in *.obj.
    if (names.empty() && text.ends_with('*' + pattern.suffix))
        return files_of_folder(folder.empty() ? "." : folder, options, pattern.prefix,
                               pattern.suffix);
    if (names.empty()) fail_at(text, "no file matches this pattern; check the path");
    std::ranges::stable_sort(names, {}, &NumberedName::number);
    return numbered_files(folder, pattern, names, 0, 1, options);
}

std::unique_ptr<Animation> open_keyframes(const std::vector<KeyframeFile>& files,
                                          const std::string& name,
                                          const AnimationOptions& options) {
    assert(!files.empty());
    FirstMesh first = read_first_mesh(files[0].path, options);
    auto source = std::make_unique<FileSource>(files, first, options);
    return stream_keyframes(name, std::move(first), std::move(source), options.warn);
}

std::unique_ptr<Animation> open_cached(const std::filesystem::path& mesh,
                                       const std::filesystem::path& cache, const std::string& name,
                                       const AnimationOptions& options) {
    FirstMesh first = read_first_mesh(mesh, options);
    auto source = std::make_unique<CacheSource>(cache, options.lenient);
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
    return stream_keyframes(name, std::move(first), std::move(source), options.warn);
}

}  // namespace mray
