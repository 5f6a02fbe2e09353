#include "tests/faults/works.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <ostream>

#include "common/image/png.h"

namespace mray::test {
namespace {

void expect_whole_file(const std::string& name, const std::string& bytes,
                       const std::string& complete) {
    if (name.ends_with(".json")) {
        EXPECT_TRUE(nlohmann::json::accept(bytes)) << name;
    } else if (name.ends_with(".xml")) {
        EXPECT_NE(bytes.find("</testsuite"), std::string::npos) << name;
    } else if (name.ends_with(".csv")) {
        EXPECT_EQ(std::count(bytes.begin(), bytes.end(), '\n'),
                  std::count(complete.begin(), complete.end(), '\n'))
            << name;
    } else {
        EXPECT_EQ(bytes, complete) << name;
    }
}

template <class T>
std::string bytes_of(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

}  // namespace

void PrintTo(const Work& work, std::ostream* out) { *out << work.name; }

std::vector<Work> works(const char* backend) {
    return {
        {"render",
         {"render", "in/scene.obj", "--backend", backend, "--threads", "2", "--size", "16x16",
          "--out", "out", "--json", "report.json", "--hits", "hits"}},
        {"crosscheck",
         {"crosscheck", "builtin:cloth:500", "--backend", backend, "--threads", "2", "--size",
          "16x16", "--frames", "0..1", "--json", "report.json", "--junit", "report.xml"}},
        {"profile",
         {"profile", "builtin:cloth:500", "--backend", backend, "--threads", "2", "--size", "16x16",
          "--frames", "0..1", "--repeat", "1", "--json", "report.json", "--csv", "frames.csv"}},
        {"trace",
         {"trace", "in/scene.ply", "--backend", backend, "--rays", "in/rays", "--out", "hits"}}};
}

std::vector<Work> input_works() {
    const auto crosscheck = [](std::vector<std::string> scene) {
        std::vector<std::string> arguments = {"crosscheck", "--backend", "cpu",
                                              "--threads",  "1",         "--size",
                                              "8x8",        "--json",    "report.json"};
        arguments.insert(arguments.end(), scene.begin(), scene.end());
        return arguments;
    };
    return {{"obj", crosscheck({"in/scene.obj"})},
            {"ply", crosscheck({"in/scene.ply"})},
            {"binary_ply", crosscheck({"in/binary.ply"})},
            {"gltf", crosscheck({"in/scene.gltf"})},
            {"cache", crosscheck({"in/scene.obj", "--cache", "in/cache.pc2", "--frames", "0..2"})},
            {"sequence", crosscheck({"in/frame_%d.obj", "--frames", "0..2"})},
            {"index", {"index", "in/scene.obj", "--cache", "in/cache.pc2"}},
            {"rays", {"trace", "in/scene.ply", "--rays", "in/rays", "--out", "hits"}},
            {"images", {"diff", "in/image.png", "in/image.png"}}};
}

void write_inputs(const TemporaryFolder& folder) {
    folder.write("in/scene.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.5\nf 1 2 3\nf 2 4 3\n");
    folder.write("in/scene.ply",
                 "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                 "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                 "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    for (const char* const frame : {"0", "1", "2"})
        folder.write(std::string("in/frame_") + frame + ".obj",
                     std::string("v 0 0 0\nv 1 0 0\nv 0 1 ") + frame + "\nf 1 2 3\n");
    const std::vector<std::byte> image =
        encode_png({4, 4, std::vector<std::uint32_t>(16, 0xFF808080u)});
    folder.write("in/image.png", {reinterpret_cast<const char*>(image.data()), image.size()});
    // Three vertices, and the triangle of them.
    const std::string points = bytes_of<float>({0, 0, 0, 1, 0, 0, 0, 1, 0});
    const std::string corners = bytes_of<std::uint32_t>({0, 1, 2});
    folder.write("in/binary.ply",
                 "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
                 "property float y\nproperty float z\nelement face 1\n"
                 "property list uchar int vertex_indices\nend_header\n" +
                     points + '\3' + corners);
    folder.write("in/scene.bin", points + corners);
    folder.write("in/scene.gltf", R"({"asset": {"version": "2.0"},
        "buffers": [{"uri": "scene.bin", "byteLength": 48}],
        "bufferViews": [{"buffer": 0, "byteLength": 36},
                        {"buffer": 0, "byteOffset": 36, "byteLength": 12}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                       "min": [0, 0, 0], "max": [1, 1, 0]},
                      {"bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}], "scene": 0})");
    std::string cache("POINTCACHE2\0", 12);
    cache +=
        bytes_of<std::uint32_t>({1, 4}) + bytes_of<float>({0, 1}) + bytes_of<std::uint32_t>({3});
    for (const float z : {0.0f, 1.0f, 2.0f})
        cache += bytes_of<float>({0, 0, z, 1, 0, 0, 0, 1, 0, 1, 1, 0.5f});
    folder.write("in/cache.pc2", cache);
    folder.write("in/rays", "0.2 0.2 5  0 0 -1\n0.9 0.9 5  0 0 -1\n5 5 5  0 0 -1\n");
}

Outputs outputs_of(const TemporaryFolder& folder) {
    Outputs files;
    for (const std::string& name : folder.names()) {
        if (name == "counts" || name.starts_with("in")) continue;
        const std::filesystem::path path = folder.path() / name;
        if (std::filesystem::is_regular_file(path)) files[name] = read_file(path);
    }
    return files;
}

void expect_whole(const Outputs& outputs, const Outputs& complete) {
    for (const auto& [name, bytes] : outputs) {
        const auto known = complete.find(name);
        if (known == complete.end()) {
            ADD_FAILURE() << "an unexpected file: " << name;
        } else {
            expect_whole_file(name, bytes, known->second);
        }
    }
}

}  // namespace mray::test
