// Readers of scenes: each must end with an animation that keeps its promises.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/errors.h"
#include "scenes/animation.h"
#include "tests/fuzz/readers/targets.h"
#include "tests/support/temporary_folder.h"

namespace mray::fuzz {
namespace {

// A file of a few bytes may have many instances.
constexpr std::uint64_t kMostTriangles = 1 << 16;
// Places in time at which an animation is looked at.
constexpr int kSteps = 16;

constexpr std::string_view kLibraryMark = "\n====\n";
constexpr std::string_view kMesh =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty int x\nproperty int y\nproperty int z\n"
    "element face 1\nproperty list int int vertex_index\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

/// The folder of this process for files of cases, in memory where the system has a place for it;
/// removed at exit.
const std::filesystem::path& case_folder() {
    constexpr const char* kMemory = "/dev/shm";
    static const test::TemporaryFolder folder(
        access(kMemory, W_OK) == 0 ? kMemory : std::filesystem::temp_directory_path());
    return folder.path();
}

/// A file in case_folder() whose content is another one in each case, made when it is first
/// written.
class CaseFile {
public:
    explicit CaseFile(std::string_view name) : path_((case_folder() / name).native()) {}
    ~CaseFile() { remove(); }
    CaseFile(const CaseFile&) = delete;

    const std::string& path() const { return path_; }
    void write(std::string_view bytes) {
        if (fd_ < 0) fd_ = open(path_.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
        const bool is_written =
            pwrite(fd_, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size());
        if (!is_written || ftruncate(fd_, static_cast<off_t>(bytes.size())) != 0)
            throw std::runtime_error("cannot write " + path_);
    }
    void remove() {
        if (fd_ < 0) return;
        unlink(path_.c_str());
        close(std::exchange(fd_, -1));
    }

private:
    std::string path_;
    /// Below 0 before it is made.
    int fd_ = -1;
};

/// Reads frames of an animation, which may be refused.
void read_frames(const Animation& animation) {
    std::vector<vec3> positions(animation.topology().vertex_count);
    const double first = animation.first_frame();
    const double span = animation.last_frame() - first;
    for (int step = 0; step <= (span > 0 ? kSteps : 0); ++step) {
        try {
            animation.positions(first + span * step / kSteps, positions);
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::kBadInput) throw;
        }
    }
}

/// Returns what is wrong with an animation; empty if nothing is.
std::string broken_promise(const Animation& animation) {
    const Topology& topology = animation.topology();
    if (topology.albedo.size() != topology.triangles.size()) return "albedo of another size";
    // Without normals there are none in glTF.
    if (!animation.smooth_corners().empty() &&
        animation.smooth_corners().size() != topology.triangles.size())
        return "smooth corners of another size";
    for (const uvec3& t : topology.triangles)
        if (std::max({t.x, t.y, t.z}) >= topology.vertex_count) return "index out of range";
    for (const uvec3& t : animation.smooth_corners())
        if (std::max({t.x, t.y, t.z}) >=
            std::max<std::size_t>(3 * topology.triangles.size(), topology.vertex_count))
            return "number of a smooth corner out of range";
    if (!(animation.first_frame() <= animation.last_frame())) return "frames out of order";
    read_frames(animation);
    return {};
}

/// Opens a scene whose messages name `file`.
std::string scene_failure(const std::string& scene, const std::string& file,
                          AnimationOptions options = {}) {
    bool is_too_large = false;
    options.check_size = [&](std::uint64_t triangles, std::uint64_t vertices) {
        is_too_large = triangles + vertices > kMostTriangles;
        if (is_too_large) throw Error(ErrorKind::kLimit, "too large");
    };
    WarningJudge warnings;
    options.warn = warnings.function();
    const std::string failure = failure_of(file, [&](bool is_lenient) {
        options.lenient = is_lenient;
        return broken_promise(*open_scene(scene, options));
    });
    if (is_too_large) return {};
    return failure.empty() ? warnings.failure() : failure;
}

std::string cache_failure(CaseFile& cache, std::string_view bytes) {
    static CaseFile mesh("mesh.ply");
    mesh.write(kMesh);
    cache.write(bytes);
    return scene_failure(mesh.path(), cache.path(), {.cache = cache.path()});
}

}  // namespace

std::string obj_failure(std::string_view bytes) {
    static CaseFile obj("case.obj");
    static CaseFile mtl("m.mtl");
    const std::size_t mark = bytes.find(kLibraryMark);
    obj.write(bytes.substr(0, mark == bytes.npos ? mark : mark + 1));
    if (mark == bytes.npos)
        mtl.remove();
    else
        mtl.write(bytes.substr(mark + kLibraryMark.size()));
    // An error is about either file.
    return scene_failure(obj.path(), case_folder().native());
}

std::string ply_failure(std::string_view bytes) {
    static CaseFile file("case.ply");
    file.write(bytes);
    return scene_failure(file.path(), file.path());
}

std::string gltf_failure(std::string_view bytes) {
    static CaseFile text("case.gltf");
    static CaseFile binary("case.glb");
    CaseFile& file = bytes.starts_with("glTF") ? binary : text;
    file.write(bytes);
    return scene_failure(file.path(), file.path());
}

std::string pc2_failure(std::string_view bytes) {
    static CaseFile file("case.pc2");
    return cache_failure(file, bytes);
}

}  // namespace mray::fuzz
