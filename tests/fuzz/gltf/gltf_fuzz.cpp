// gltf_fuzz: opens glTF files that were changed at random. Each must be refused with its name, or
// be a clip whose vertices lie in its bounds at all times. `./fuzz gltf` builds and runs it.
//
//   gltf_fuzz --seed N --cases N --out DIR FILE...   changes the files; 0 cases: as they are
#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/base/errors.h"
#include "common/scene/scene_source.h"
#include "common/text/number_text.h"
#include "tests/fuzz/gltf/mutations.h"

namespace mray::fuzz {
namespace {

constexpr std::uint64_t kMostTriangles = 1 << 16;
constexpr double kMostSteps = 16;

struct Options {
    std::uint64_t seed = 1;
    std::uint64_t cases = 1000;
    std::filesystem::path out = "out/fuzz";
    std::vector<std::filesystem::path> files;
};

Options parse(int count, char** arguments) {
    Options options;
    for (int i = 1; i < count; ++i) {
        const std::string name = arguments[i];
        if (!name.starts_with("--")) {
            options.files.emplace_back(name);
            continue;
        }
        if (++i == count) throw std::runtime_error(name + " needs a value");
        if (name == "--out") options.out = arguments[i];
        if (name == "--seed") options.seed = parse_unsigned(arguments[i]).value_or(0);
        if (name == "--cases") options.cases = parse_unsigned(arguments[i]).value_or(0);
    }
    if (options.files.empty()) throw std::runtime_error("give .gltf and .glb files");
    return options;
}

std::string bytes_of(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

/// What is wrong with a clip; empty if nothing is.
std::string problem_of(const Clip& clip) {
    const WorldBounds bounds = clip.bounds();
    std::vector<vec3> positions(clip.topology().vertex_count);
    for (const uvec3& t : clip.topology().triangles)
        for (int k = 0; k < 3; ++k)
            if (t[k] >= positions.size()) return "an index is out of range";
    for (double step = 0; step <= kMostSteps; ++step) {
        const double frame = clip.last_frame() * (step / kMostSteps);
        try {
            clip.positions(frame, positions);
        } catch (const Error& error) {
            if (error.kind() == ErrorKind::kBadInput) continue;
            throw;
        }
        for (const vec3& p : positions) {
            for (int axis = 0; axis < 3; ++axis) {
                const auto x = static_cast<double>(p[axis]);
                if (!(x >= bounds.lower[axis] && x <= bounds.upper[axis]))
                    return fmt::format("frame {}: {} is not in the bounds", frame, x);
            }
        }
    }
    return {};
}

/// Opens a file; what is wrong with the answer, or empty. Counts the files that are read.
std::string problem_of(const std::filesystem::path& path, std::uint64_t& read_count) {
    SceneOptions options;
    options.check_size = [](std::uint64_t triangles, std::uint64_t vertices) {
        if (triangles + vertices > kMostTriangles) throw Error(ErrorKind::kLimit, "too large");
    };
    try {
        const std::unique_ptr<Clip> clip = open_scene(path.native(), options);
        ++read_count;
        return problem_of(*clip);
    } catch (const Error& error) {
        if (error.kind() == ErrorKind::kLimit) return {};
        const bool has_name = std::string(error.what()).starts_with(path.native() + ": ");
        if (error.kind() == ErrorKind::kBadInput && has_name) return {};
        return fmt::format("refused as \"{}\"", error.what());
    } catch (const std::exception& error) {
        return fmt::format("throws \"{}\"", error.what());
    }
}

int run(const Options& options) {
    std::filesystem::create_directories(options.out);
    // Stays there after a crash.
    const std::string stem = (options.out / fmt::format("gltf-{}", options.seed)).native();
    std::mt19937_64 random(options.seed);
    std::vector<std::string> corpus;
    std::uint64_t read_count = 0;
    for (const std::filesystem::path& file : options.files) {
        corpus.push_back(bytes_of(file));
        const std::string problem = problem_of(file, read_count);
        if (problem.empty()) continue;
        fmt::print(stderr, "{}: {}\n", file.native(), problem);
        return EXIT_FAILURE;
    }
    for (std::uint64_t i = 0; i < options.cases; ++i) {
        const std::string bytes = mutated(corpus[random() % corpus.size()], random);
        const std::string path = stem + (bytes.starts_with("glTF") ? ".glb" : ".gltf");
        std::ofstream(path, std::ios::binary) << bytes;
        const std::string problem = problem_of(path, read_count);
        if (!problem.empty()) {
            fmt::print(stderr, "{}: case {}: {}\n", path, i, problem);
            return EXIT_FAILURE;
        }
    }
    fmt::print("{} files and {} cases from seed {}: {} in their bounds, the others refused\n",
               corpus.size(), options.cases, options.seed, read_count);
    for (const char* const extension : {".glb", ".gltf"}) std::filesystem::remove(stem + extension);
    return EXIT_SUCCESS;
}

}  // namespace
}  // namespace mray::fuzz

int main(int count, char** arguments) {
    try {
        return mray::fuzz::run(mray::fuzz::parse(count, arguments));
    } catch (const std::exception& error) {
        fmt::print(stderr, "gltf_fuzz: {}\n", error.what());
        return EXIT_FAILURE;
    }
}
