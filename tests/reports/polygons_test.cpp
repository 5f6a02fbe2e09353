// Polygons of reports by users of other tools: what their triangles cover.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <memory>
#include <string>
#include <vector>

#include "scenes/animation.h"
#include "tests/support/temporary_folder.h"

namespace mray::test {
namespace {

struct MeasuredFaces {
    std::vector<std::string> warnings;
    std::size_t triangles = 0;
    double area = 0;
};

MeasuredFaces open(const std::string& vertices_and_faces) {
    const TemporaryFolder folder;
    MeasuredFaces opened;
    const std::unique_ptr<Animation> animation = open_scene(
        folder.write("polygons.obj", vertices_and_faces).native(),
        {.warn = [&](const Warning& warning) { opened.warnings.push_back(warning.line()); }});
    const Topology& topology = animation->topology();
    std::vector<vec3> positions(topology.vertex_count);
    animation->positions(0, positions);
    opened.triangles = topology.triangles.size();
    for (const uvec3& t : topology.triangles) {
        const vec3 a = positions[t.x];
        opened.area += 0.5 * glm::length(glm::cross(positions[t.y] - a, positions[t.z] - a));
    }
    return opened;
}

TEST(PolygonReports, Tinyobjloader386ASpikeAddsNoArea) {
    const MeasuredFaces spike = open(
        "v 0 0 0\nv 6 0 0\nv 6 4 0\nv 3 4 0\nv 3 7 0\nv 0 4 0\n"
        "f 1 2 3 4 5 4 6\n");
    EXPECT_EQ(spike.triangles, 5u);
    EXPECT_FLOAT_EQ(static_cast<float>(spike.area), 24);
    EXPECT_TRUE(spike.warnings.empty());
}

TEST(PolygonReports, Cjio192AFaceThatCrossesItselfIsNamedWithItsLine) {
    const MeasuredFaces bow_ties = open(
        "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n"
        "f 1 2 3\nf 1 2 3 4\nf 1 3 2 4\nf 1 3 4 2\n");
    EXPECT_EQ(bow_ties.triangles, 7u);
    ASSERT_EQ(bow_ties.warnings.size(), 1u);
    EXPECT_NE(bow_ties.warnings[0].find("polygons.obj:7: warning: face crosses itself"),
              std::string::npos)
        << bow_ties.warnings[0];
    EXPECT_TRUE(bow_ties.warnings[0].ends_with("(and 1 more)"));
}

}  // namespace
}  // namespace mray::test
