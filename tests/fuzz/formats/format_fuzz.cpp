// format_fuzz [--seed N] [--cases N] [--out DIR] FILE...: reads the files of a corpus (meshes,
// glTF, point caches), and N files made of them by changes. A reading must end with a clip that
// keeps its promises, or with an error about the file. Prints the seed of a case that does not, and
// writes its file to DIR; after a crash it lies in the temporary folder. Exit codes: 0 all good, 1
// a failure, 2 usage. `./fuzz formats` builds and runs it.
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/errors.h"
#include "common/scene/scene_source.h"
#include "common/text/number_text.h"
#include "tests/fuzz/formats/mutations.h"
#include "tests/support/temporary_folder.h"

namespace mray::fuzz {
namespace {

/// A file may claim 4 GiB, and must not get them.
constexpr rlim_t kMostMemory = rlim_t{3} << 30;
// A file of a few bytes may have many instances.
constexpr std::uint64_t kMostTriangles = 1 << 16;
// Places in time at which a clip is looked at.
constexpr int kSteps = 16;

struct CorpusFile {
    std::string name;
    /// With its dot.
    std::string extension;
    std::string bytes;
};

struct Options {
    std::uint64_t seed = 1;
    std::uint64_t cases = 0;
    std::string out = "out/fuzz";
    std::vector<std::string> files;
};

std::optional<Options> parse(int count, char** arguments) {
    Options options;
    for (int i = 1; i < count; ++i) {
        const std::string_view argument = arguments[i];
        if (!argument.starts_with("--")) {
            options.files.emplace_back(argument);
            continue;
        }
        if (++i == count) return std::nullopt;
        const auto number = parse_unsigned(arguments[i]);
        if (argument == "--out")
            options.out = arguments[i];
        else if (argument == "--seed" && number)
            options.seed = *number;
        else if (argument == "--cases" && number)
            options.cases = *number;
        else
            return std::nullopt;
    }
    if (options.files.empty()) return std::nullopt;
    return options;
}

bool is_cache(const CorpusFile& file) {
    return file.extension == ".pc2" || file.extension == ".mdd";
}

/// Positions that are out of bounds; empty if none are.
std::string beyond_bounds(const Clip& clip, double frame, const std::vector<vec3>& positions) {
    const WorldBounds bounds = clip.bounds();
    for (const vec3& p : positions) {
        for (int axis = 0; axis < 3; ++axis) {
            const auto x = static_cast<double>(p[axis]);
            if (!(x >= bounds.lower[axis] && x <= bounds.upper[axis]))
                return fmt::format("frame {}: {} is not in the bounds", frame, x);
        }
    }
    return {};
}

/// What is wrong with the frames of a clip; empty if nothing is.
std::string broken_frame(const Clip& clip, bool is_lenient) {
    std::vector<vec3> positions(clip.topology().vertex_count);
    const double first = clip.first_frame();
    for (int step = 0; step <= kSteps; ++step) {
        const double frame = first + (clip.last_frame() - first) * step / kSteps;
        if (!clip.usable(frame)) continue;
        try {
            clip.positions(frame, positions);
        } catch (const Error& error) {
            // Of a vertex that is too far at a time between those that were looked at.
            if (error.kind() != ErrorKind::kBadInput) throw;
            continue;
        }
        // Lenient clips keep coordinates that are not finite.
        if (is_lenient) continue;
        const std::string wrong = beyond_bounds(clip, frame, positions);
        if (!wrong.empty()) return wrong;
    }
    return {};
}

/// What is wrong with a clip; empty if nothing is.
std::string broken_promise(const Clip& clip, bool is_lenient) {
    const Topology& topology = clip.topology();
    if (topology.albedo.size() != topology.triangles.size()) return "albedo of another size";
    // Without normals there are none in glTF.
    if (!clip.smooth_corners().empty() && clip.smooth_corners().size() != topology.triangles.size())
        return "smooth corners of another size";
    for (const uvec3& t : topology.triangles)
        if (std::max({t.x, t.y, t.z}) >= topology.vertex_count) return "index out of range";
    for (const uvec3& t : clip.smooth_corners())
        if (std::max({t.x, t.y, t.z}) >=
            std::max<std::size_t>(3 * topology.triangles.size(), topology.vertex_count))
            return "number of a smooth corner out of range";
    if (!(clip.first_frame() <= clip.last_frame())) return "frames out of order";
    return broken_frame(clip, is_lenient);
}

/// What goes wrong when a file is read; empty for a good clip and for an error about the file.
std::string failure_of(const test::TemporaryFolder& folder, const CorpusFile& file,
                       const std::string& bytes, bool is_lenient) {
    // Writing over a file waits for the disk.
    std::filesystem::remove(folder.file("case" + file.extension));
    const std::string path = folder.write("case" + file.extension, bytes).native();
    SceneOptions options{.lenient = is_lenient};
    if (is_cache(file)) options.cache = path;
    bool is_too_large = false;
    options.check_size = [&](std::uint64_t triangles, std::uint64_t vertices) {
        is_too_large = triangles + vertices > kMostTriangles;
        if (is_too_large) throw Error(ErrorKind::kLimit, "too large");
    };
    try {
        return broken_promise(*open_scene(is_cache(file) ? folder.file("mesh.ply") : path, options),
                              is_lenient);
    } catch (const Error& error) {
        if (is_too_large) return {};
        const std::string_view message = error.what();
        if (error.kind() != ErrorKind::kBadInput && error.kind() != ErrorKind::kLimit)
            return fmt::format("error of another kind: {}", message);
        if (message.find('\n') != std::string_view::npos) return "a message of several lines";
        return message.find("case" + file.extension) != std::string_view::npos
                   ? ""
                   : fmt::format("an error that does not name the file: {}", message);
    } catch (const std::exception& error) {
        return fmt::format("exception: {}", error.what());
    }
}

int report(const Options& options, const CorpusFile& file, const std::string& bytes,
           const std::string& which, const std::string& failure) {
    std::filesystem::create_directories(options.out);
    const std::string path = fmt::format("{}/{}{}", options.out, which, file.extension);
    std::ofstream(path, std::ios::binary) << bytes;
    fmt::print(stderr, "{} of {}: {}; written to {}\n", which, file.name, failure, path);
    return 1;
}

int run(const Options& options) {
    std::vector<CorpusFile> corpus;
    for (const std::string& file : options.files) {
        const std::filesystem::path path(file);
        corpus.push_back(
            {path.filename().native(), path.extension().native(), test::read_file(path)});
    }
    const test::TemporaryFolder folder;
    folder.write("mesh.ply",
                 "ply\nformat ascii 1.0\nelement vertex 3\nproperty int x\nproperty int y\n"
                 "property int z\nelement face 1\nproperty list int int vertex_index\nend_header\n"
                 "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    for (const CorpusFile& file : corpus) {
        for (const bool is_lenient : {false, true}) {
            const std::string failure = failure_of(folder, file, file.bytes, is_lenient);
            if (!failure.empty()) return report(options, file, file.bytes, "the file", failure);
        }
    }
    for (std::uint64_t i = 0; i < options.cases; ++i) {
        Dice dice(options.seed + i);
        const CorpusFile& file = corpus[dice.below(static_cast<std::uint32_t>(corpus.size()))];
        const std::string bytes = mutated(file.bytes, dice);
        const std::string failure = failure_of(folder, file, bytes, dice.one_in(2));
        if (!failure.empty())
            return report(options, file, bytes, fmt::format("seed-{}", options.seed + i), failure);
    }
    fmt::print("{} files of the corpus, {} cases: all good\n", corpus.size(), options.cases);
    return 0;
}

}  // namespace
}  // namespace mray::fuzz

int main(int count, char** arguments) {
    const auto options = mray::fuzz::parse(count, arguments);
    if (!options) {
        fmt::print(stderr, "usage: format_fuzz [--seed N] [--cases N] [--out DIR] FILE...\n");
        return 2;
    }
#ifndef __SANITIZE_ADDRESS__
    const rlimit memory = {mray::fuzz::kMostMemory, mray::fuzz::kMostMemory};
    setrlimit(RLIMIT_AS, &memory);
#endif
    return mray::fuzz::run(*options);
}
