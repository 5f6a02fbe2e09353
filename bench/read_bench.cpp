// morphray_read_bench [VERTICES]: how fast files of scenes are read, from files that the system has
// in memory already. Prints rows of CSV; bench/readers adds the head.
#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "clips/mesh_files/mesh_file.h"
#include "clips/point_cache/point_cache.h"
#include "common/base/stopwatch.h"
#include "common/text/number_text.h"
#include "tools/measure/median.h"

namespace mray::bench {
namespace {

namespace fs = std::filesystem;

constexpr int kRounds = 15;
constexpr std::uint32_t kSamples = 6;

/// A square sheet with a given number of vertices, more or less.
struct Sheet {
    std::uint32_t side;
    std::vector<vec3> positions;
    std::vector<std::uint32_t> indices;

    explicit Sheet(std::uint64_t vertices)
        : side(static_cast<std::uint32_t>(std::sqrt(static_cast<double>(vertices)))) {
        for (std::uint32_t i = 0; i < side * side; ++i) {
            const auto x = static_cast<float>(i % side);
            const auto z = static_cast<float>(i / side);
            positions.emplace_back(x * 0.001f, std::sin(x * 0.05f) * std::cos(z * 0.03f),
                                   z * 0.001f);
        }
        for (std::uint32_t z = 0; z + 1 < side; ++z) {
            for (std::uint32_t x = 0; x + 1 < side; ++x) {
                const std::uint32_t i = z * side + x;
                for (const std::uint32_t k : {i, i + side, i + 1, i + 1, i + side, i + side + 1})
                    indices.push_back(k);
            }
        }
    }
};

void write(const fs::path& path, const std::string& bytes) {
    std::FILE* const file = std::fopen(path.c_str(), "wb");
    if (file == nullptr || std::fwrite(bytes.data(), 1, bytes.size(), file) != bytes.size() ||
        std::fclose(file) != 0) {
        std::perror(path.c_str());
        std::exit(5);
    }
}

template <class T>
void append(std::string& bytes, T value, bool is_big_endian) {
    auto bits = std::bit_cast<std::uint32_t>(value);
    if (is_big_endian) bits = __builtin_bswap32(bits);
    bytes.append(reinterpret_cast<const char*>(&bits), sizeof bits);
}

std::string obj_of(const Sheet& sheet) {
    std::string text;
    for (const vec3& p : sheet.positions) text += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
    for (std::size_t i = 0; i < sheet.indices.size(); i += 3) {
        text += fmt::format("f {} {} {}\n", sheet.indices[i] + 1, sheet.indices[i + 1] + 1,
                            sheet.indices[i + 2] + 1);
    }
    return text;
}

std::string ply_of(const Sheet& sheet, const std::string& format) {
    std::string bytes = fmt::format(
        "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
        "property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        format, sheet.positions.size(), sheet.indices.size() / 3);
    const bool is_big_endian = format == "binary_big_endian";
    const bool is_text = format == "ascii";
    for (const vec3& p : sheet.positions) {
        if (is_text) bytes += fmt::format("{} {} {}\n", p.x, p.y, p.z);
        for (int axis = 0; axis < 3 && !is_text; ++axis) append(bytes, p[axis], is_big_endian);
    }
    for (std::size_t i = 0; i < sheet.indices.size(); i += 3) {
        if (is_text) {
            bytes += fmt::format("3 {} {} {}\n", sheet.indices[i], sheet.indices[i + 1],
                                 sheet.indices[i + 2]);
            continue;
        }
        bytes += '\3';
        for (std::size_t k = 0; k < 3; ++k) append(bytes, sheet.indices[i + k], is_big_endian);
    }
    return bytes;
}

std::string cache_of(const Sheet& sheet, bool is_mdd) {
    std::string bytes;
    const auto points = static_cast<std::uint32_t>(sheet.positions.size());
    if (is_mdd) {
        append(bytes, kSamples, true);
        append(bytes, points, true);
        for (std::uint32_t i = 0; i < kSamples; ++i) append(bytes, static_cast<float>(i), true);
    } else {
        bytes.assign("POINTCACHE2\0", 12);
        append(bytes, std::uint32_t{1}, false);
        append(bytes, points, false);
        append(bytes, 0.0f, false);
        append(bytes, 1.0f, false);
        append(bytes, kSamples, false);
    }
    for (std::uint32_t i = 0; i < kSamples; ++i)
        for (const vec3& p : sheet.positions)
            for (int axis = 0; axis < 3; ++axis) append(bytes, p[axis], is_mdd);
    return bytes;
}

double median_ms(const std::function<void(int)>& work) {
    std::vector<double> times;
    for (int round = -2; round < kRounds; ++round) {
        const Stopwatch watch;
        work(round + 2);
        if (round >= 0) times.push_back(watch.ms());
    }
    return median(times);
}

void report(const char* work, std::uint64_t bytes, std::size_t vertices, double ms,
            double memcpy_gb_s) {
    const double gb_s = static_cast<double>(bytes) / ms * 1e-6;
    fmt::print("{},{},{},{:.3f},{:.3f},{:.3f}\n", work, vertices, bytes, ms, gb_s,
               gb_s / memcpy_gb_s);
    std::fflush(stdout);
}

void bench_cache(const fs::path& path, const Sheet& sheet, bool is_mdd, double memcpy_gb_s) {
    write(path, cache_of(sheet, is_mdd));
    const PointCache cache(path);
    std::vector<vec3> out(cache.point_count());
    const double ms =
        median_ms([&](int round) { cache.read(static_cast<std::size_t>(round) % kSamples, out); });
    if (out != sheet.positions) fmt::print("# {} was read wrongly\n", path.native());
    report(is_mdd ? "frame of MDD" : "frame of PC2", out.size() * sizeof(vec3), out.size(), ms,
           memcpy_gb_s);
    fs::remove(path);
}

void bench_mesh(const fs::path& path, const char* work, const Sheet& sheet,
                const std::string& bytes, double memcpy_gb_s) {
    write(path, bytes);
    const double ms = median_ms([&](int) {
        const FileMesh mesh = read_mesh_file(path, {});
        if (mesh.positions.size() != sheet.positions.size() || mesh.faces.corners != sheet.indices)
            fmt::print("# {} was read wrongly\n", path.native());
    });
    report(work, bytes.size(), sheet.positions.size(), ms, memcpy_gb_s);
    fs::remove(path);
}

void run(std::uint64_t vertices) {
    const Sheet sheet(vertices);
    const fs::path folder = fs::temp_directory_path() / fmt::format("morphray_read_{}", vertices);
    fs::create_directories(folder);

    // As many samples as the caches have, so that the source comes from memory, too.
    std::vector<std::vector<vec3>> samples(kSamples, sheet.positions);
    std::vector<vec3> out(sheet.positions.size());
    const std::size_t bytes = out.size() * sizeof(vec3);
    const double ms = median_ms([&](int round) {
        std::memcpy(out.data(), samples[static_cast<std::size_t>(round) % kSamples].data(), bytes);
    });
    const double memcpy_gb_s = static_cast<double>(bytes) / ms * 1e-6;
    report("memcpy", bytes, out.size(), ms, memcpy_gb_s);

    bench_cache(folder / "a.pc2", sheet, false, memcpy_gb_s);
    bench_cache(folder / "a.mdd", sheet, true, memcpy_gb_s);
    for (const char* format : {"binary_little_endian", "binary_big_endian", "ascii"}) {
        const std::string work = fmt::format("PLY {}", format);
        bench_mesh(folder / "a.ply", work.c_str(), sheet, ply_of(sheet, format), memcpy_gb_s);
    }
    bench_mesh(folder / "a.obj", "OBJ", sheet, obj_of(sheet), memcpy_gb_s);
    fs::remove_all(folder);
}

}  // namespace
}  // namespace mray::bench

int main(int count, char** arguments) {
    const auto vertices = mray::parse_unsigned(count > 1 ? arguments[1] : "1000000");
    if (!vertices || *vertices < 9 || *vertices > 100'000'000) {
        fmt::print(stderr, "usage: morphray_read_bench [VERTICES], from 9 to 100,000,000\n");
        return 2;
    }
    mray::bench::run(*vertices);
    return 0;
}
