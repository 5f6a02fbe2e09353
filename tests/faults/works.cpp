#include "tests/faults/works.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>

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

void write_inputs(const TemporaryFolder& folder) {
    folder.write("in/scene.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.5\nf 1 2 3\nf 2 4 3\n");
    folder.write("in/scene.ply",
                 "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                 "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                 "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
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
