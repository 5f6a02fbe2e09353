// reader_fuzz TARGET FILE...: gives a reader of files that others made the bytes of these files.
// Built with libFuzzer (the preset `fuzz`), it takes that one's arguments after TARGET, such as
// folders of files from which it makes others. A reader ends with a value that keeps the promises
// of its type, or with an error of the project about the input in one line that names the file.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/image_files.h"
#include "common/base/errors.h"
#include "scenes/animation.h"
#include "scenes/obj/obj_reader.h"
#include "tests/support/temporary_folder.h"

namespace mray::fuzz {
namespace {

// A path of 4096 bytes, all of them escaped, and some text.
constexpr std::size_t kLongestMessage = 20000;

/// Returns what is wrong with a message that has to contain `name`; empty if nothing is.
std::string message_failure(std::string_view message, std::string_view name) {
    if (message.size() > kLongestMessage)
        return fmt::format("a message of {} bytes", message.size());
    if (std::ranges::any_of(message, [](char c) { return (c >= 0 && c < ' ') || c == '\x7f'; }))
        return fmt::format("a message of several lines or with control characters: {}", message);
    if (message.find(name) == std::string_view::npos)
        return fmt::format("an error that does not name the file: {}", message);
    return {};
}

/// Calls work(is_lenient), which returns what is wrong, and judges what it throws. What is refused
/// when it is read strictly is read leniently, too, if there is such a way.
template <class Work>
std::string failure_of(std::string_view name, Work work,
                       std::initializer_list<bool> ways = {false, true}) {
    for (const bool is_lenient : ways) {
        try {
            return work(is_lenient);
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::kBadInput && error.kind() != ErrorKind::kLimit)
                return fmt::format("error of another kind: {}", error.what());
            const std::string failure = message_failure(error.what(), name);
            if (!failure.empty()) return failure;
        } catch (const std::exception& error) {
            return std::string("exception: ") + error.what();
        }
    }
    return {};
}

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
const test::TemporaryFolder& case_folder() {
    constexpr const char* kMemory = "/dev/shm";
    static const test::TemporaryFolder folder(
        access(kMemory, W_OK) == 0 ? kMemory : std::filesystem::temp_directory_path());
    return folder;
}

/// Writes a file of a case; returns its path.
std::string write_case(const char* name, std::string_view bytes) {
    return case_folder().write(name, std::string(bytes)).native();
}

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
    std::string bad_warning;
    options.warn = [&](const Warning& warning) {
        if (bad_warning.empty()) bad_warning = message_failure(warning.line(), {});
    };
    const std::string failure = failure_of(file, [&](bool is_lenient) {
        options.lenient = is_lenient;
        return broken_promise(*open_scene(scene, options));
    });
    if (is_too_large) return {};
    return failure.empty() ? bad_warning : failure;
}

/// What follows a line `====` is the material library m.mtl beside the OBJ file.
std::string obj_failure(std::string_view bytes) {
    const std::size_t mark = bytes.find(kLibraryMark);
    const std::string obj =
        write_case("case.obj", bytes.substr(0, mark == bytes.npos ? mark : mark + 1));
    if (mark == bytes.npos)
        std::filesystem::remove(case_folder().file("m.mtl"));
    else
        write_case("m.mtl", bytes.substr(mark + kLibraryMark.size()));
    // An error is about either file.
    return scene_failure(obj, case_folder().path().native());
}

std::string ply_failure(std::string_view bytes) {
    const std::string file = write_case("case.ply", bytes);
    return scene_failure(file, file);
}

std::string gltf_failure(std::string_view bytes) {
    const std::string file =
        write_case(bytes.starts_with("glTF") ? "case.glb" : "case.gltf", bytes);
    return scene_failure(file, file);
}

/// Positions of a mesh of three vertices.
std::string pc2_failure(std::string_view bytes) {
    const std::string cache = write_case("case.pc2", bytes);
    return scene_failure(write_case("mesh.ply", kMesh), cache, {.cache = cache});
}

template <class Decode>
std::string image_failure(std::string_view bytes, const std::string& name, Decode decode) {
    // The limits of textures, and small, since compressed files of few bytes may have many pixels.
    constexpr app::ImageLimits kLimits = {.side = 4096, .pixels = 1 << 16};
    const auto work = [&](bool) {
        const Image image = decode(std::string(bytes), name, kLimits);
        const bool is_right = image.pixels.size() == std::size_t{image.width} * image.height;
        return is_right && !image.pixels.empty() ? ""
                                                 : "an image of another size than it has pixels";
    };
    return failure_of(name, work, {false});
}

std::string png_failure(std::string_view bytes) {
    return image_failure(bytes, "case.png", app::decode_png);
}

std::string jpeg_failure(std::string_view bytes) {
    return image_failure(bytes, "case.jpg", app::decode_jpeg);
}

std::string mtl_failure(std::string_view bytes) {
    return failure_of("case.mtl", [&](bool) {
        constexpr Albedo kLargest = 0x00FFFFFF;
        WarningCount unread;
        for (const auto& [name, material] : read_mtl_text(bytes, "case.mtl", unread)) {
            if (material.albedo > kLargest) return "an albedo of more than 24 bits";
            for (std::size_t axis = 0; axis < 2; ++axis)
                if (!std::isfinite(material.scale[axis]) || !std::isfinite(material.offset[axis]))
                    return "texture coordinates that are not finite";
        }
        return "";
    });
}

struct Target {
    /// The name of the folder with its corpus, too.
    std::string_view name;
    std::string (*failure_of)(std::string_view bytes);
};
constexpr Target kTargets[] = {{"obj", obj_failure},   {"mtl", mtl_failure}, {"ply", ply_failure},
                               {"gltf", gltf_failure}, {"pc2", pc2_failure}, {"png", png_failure},
                               {"jpeg", jpeg_failure}};
const Target* target = nullptr;

/// Takes TARGET from the arguments.
void choose_target(int& count, char**& arguments) {
    if (count > 1) {
        const auto found = std::ranges::find(kTargets, arguments[1], &Target::name);
        if (found != std::end(kTargets)) target = found;
    }
    if (target == nullptr) {
        fmt::print(stderr, "reader_fuzz TARGET FILE...; targets: obj mtl ply gltf pc2 png jpeg\n");
        std::exit(2);
    }
    arguments[1] = arguments[0];
    ++arguments;
    --count;
}

}  // namespace
}  // namespace mray::fuzz

#ifdef MORPHRAY_LIBFUZZER
extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
    mray::fuzz::choose_target(*count, *arguments);
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
    const std::string failure =
        mray::fuzz::target->failure_of({reinterpret_cast<const char*>(bytes), size});
    if (failure.empty()) return 0;
    fmt::print(stderr, "{}\n", failure);
    std::abort();
}
#else
int main(int count, char** arguments) {
    mray::fuzz::choose_target(count, arguments);
    int code = 0;
    for (int i = 1; i < count; ++i) {
        // Before a crash, too.
        fmt::print(stderr, "{}\n", arguments[i]);
        const std::string failure =
            mray::fuzz::target->failure_of(mray::test::read_file(arguments[i]));
        if (failure.empty()) continue;
        fmt::print(stderr, "{}\n", failure);
        code = 1;
    }
    return code;
}
#endif
