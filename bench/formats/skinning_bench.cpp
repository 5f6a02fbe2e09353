// Skinning of glTF vertices, compared with reading and writing them: bench/skinning builds and runs
// it.
#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "clips/gltf/motion/skinning.h"
#include "common/base/stopwatch.h"
#include "common/base/thread_arena.h"
#include "tools/measure/median.h"

namespace mray::bench {
namespace {

constexpr std::size_t kPerVertex = 4;
constexpr std::size_t kJoints = 64;
constexpr int kRuns = 21;

/// Vertices of one skin, with four joints and a number of morph targets each.
gltf::GltfScene skinned_scene(std::size_t vertex_count, std::size_t target_count) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> any(0, 1);
    gltf::GltfScene scene;
    gltf::Mesh& mesh = scene.meshes[0];
    gltf::VertexSet& set = mesh.sets.emplace_back();
    gltf::Influences& influences = set.influences;
    influences.per_vertex = kPerVertex;
    for (std::size_t i = 0; i < vertex_count; ++i) {
        set.positions.emplace_back(any(random), any(random), any(random));
        // Neighbours follow the same joints, as in a body.
        const std::size_t first = i * (kJoints - kPerVertex) / vertex_count;
        for (std::size_t k = 0; k < kPerVertex; ++k) {
            influences.joints.push_back(static_cast<std::uint16_t>(first + k));
            influences.weights.push_back(any(random));
        }
    }
    mesh.target_count = target_count;
    mesh.weights.assign(target_count, 0.5);
    set.targets.resize(target_count);
    for (gltf::MorphTarget& target : set.targets) target.deltas = set.positions;
    gltf::Skin& skin = scene.skins[0];
    skin.inverse_binds.resize(kJoints);
    for (std::uint32_t joint = 0; joint < kJoints; ++joint) {
        skin.joints.push_back(joint);
        gltf::Node& node = scene.tree.nodes.emplace_back();
        node.trs.translation = {static_cast<double>(any(random)), 0, 0};
        scene.tree.parents_first.push_back(joint);
    }
    gltf::Node& node = scene.tree.nodes.emplace_back();
    node.mesh = 0;
    scene.tree.parents_first.push_back(kJoints);
    scene.parts.push_back({kJoints, &set, 0u, 0});
    scene.topology.vertex_count = static_cast<std::uint32_t>(vertex_count);
    return scene;
}

/// Reads all that skinning reads, and writes as much as it writes.
void read_and_write(const gltf::VertexSet& set, std::span<vec3> out) {
    using Range = tbb::blocked_range<std::size_t>;
    tbb::parallel_for(Range(0, out.size(), 4096), [&](const Range& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            float sum = 0;
            std::uint32_t joints = 0;
            for (std::size_t k = 0; k < kPerVertex; ++k) {
                sum += set.influences.weights[kPerVertex * i + k];
                joints += set.influences.joints[kPerVertex * i + k];
            }
            vec3 p = set.positions[i];
            for (const gltf::MorphTarget& target : set.targets) p = p + target.deltas[i];
            out[i] = p + vec3(sum, static_cast<float>(joints), 0);
        }
    });
}

double median_ms(const std::function<void()>& work) {
    std::vector<double> times;
    work();
    for (int i = 0; i < kRuns; ++i) {
        const Stopwatch watch;
        work();
        times.push_back(watch.ms());
    }
    return median(times);
}

void measure(std::size_t vertex_count, std::size_t target_count, int threads) {
    const gltf::GltfScene scene = skinned_scene(vertex_count, target_count);
    const gltf::Skinning skinning(scene);
    std::vector<vec3> out(vertex_count);
    ThreadArena arena(threads);
    const double pass =
        median_ms([&] { arena.execute([&] { read_and_write(*scene.parts[0].set, out); }); });
    const double skin =
        median_ms([&] { arena.execute([&] { skinning.place(gltf::pose_at(scene, 0), out); }); });
    fmt::print("{},{},{},{:.3f},{:.3f},{:.2f}\n", vertex_count, target_count, arena.threads(), pass,
               skin, skin / pass);
}

}  // namespace
}  // namespace mray::bench

int main() {
    fmt::print("vertices,morph_targets,threads,read_write_ms,skin_ms,ratio\n");
    for (const std::size_t targets : {0u, 2u})
        for (const int threads : {1, 0}) mray::bench::measure(1000000, targets, threads);
    return EXIT_SUCCESS;
}
