// driver_fuzz [--seed S] [--cases N] [--device NAME]: judges the rays of a device's driver
// (VK_KHR_ray_query) on the meshes and rays of the fuzzer's generator, prints how many answers of
// each kind are wrong, and the smallest reproducer of each kind. Exit codes: 0 whatever is wrong, 2
// usage, 4 no such device.
#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "accuracy/suspect/reproducer.h"
#include "accuracy/suspect/suspect.h"
#include "common/base/errors.h"
#include "cpu/cpu_backend.h"
#include "gpu/ray_query/ray_query.h"
#include "tests/fuzz/case/fuzz_case.h"
#include "tests/fuzz/generate/generator.h"

namespace mray::fuzz {
namespace {

using namespace accuracy;

struct DriverFuzzOptions {
    std::uint64_t seed = 1;
    std::uint64_t cases = 1000;
    gpu::VulkanConfig vulkan;
};

/// None if they are no options.
std::optional<DriverFuzzOptions> read_options(int argc, char** argv) {
    DriverFuzzOptions options;
    for (int i = 1; i < argc; i += 2) {
        const std::string name = argv[i];
        if (i + 1 == argc) return std::nullopt;
        const std::string value = argv[i + 1];
        char* end = argv[i + 1];
        if (name == "--device") {
            options.vulkan.device = value;
            continue;
        }
        const std::uint64_t number = std::strtoull(argv[i + 1], &end, 10);
        if (value.empty() || *end != '\0' || value.front() == '-') return std::nullopt;
        if (name == "--seed") {
            options.seed = number;
        } else if (name == "--cases") {
            options.cases = number;
        } else {
            return std::nullopt;
        }
    }
    return options;
}

class DriverFuzz {
public:
    explicit DriverFuzz(const gpu::VulkanConfig& config)
        : driver_(gpu::make_ray_query(config)), ours_(cpu::make_cpu_backend()) {}

    const std::string& driver() const { return driver_->description(); }
    const SuspectCounts& counts() const { return counts_; }

    /// Judges the mesh of a case at its frame, updated from the pose that its tree is built at.
    void judge(std::uint64_t seed) {
        FuzzCase fuzz_case = make_case(seed, {.tests = 1, .rays = kRays});
        const FuzzScene scene(fuzz_case);
        const Topology& topology = scene.topology();
        if (topology.triangles.empty()) return;
        std::vector<Ray> rays;
        for (const WorldRay& world : fuzz_case.rays) {
            const SceneRay ray = to_scene(scene.space(), world);
            if (ray.valid) rays.push_back(ray.ray);
        }
        const PosedMesh mesh{topology, scene.positions(), scene.rebuilt(),
                             is_closed(topology, scene.positions())};
        driver_->set_scene(topology, scene.built_positions());
        driver_->update(scene.positions());
        ours_->set_scene(topology, scene.positions(), scene.rebuilt());
        const Judged judged = judge_suspect(*driver_, *ours_, mesh, rays, 1);
        counts_.rays += judged.counts.rays;
        for (std::size_t i = 0; i < kFaultCount; ++i) counts_.faults[i] += judged.counts.faults[i];
        for (const Finding& finding : judged.findings) keep_smallest(seed, mesh, rays, finding);
    }

    void print() const {
        fmt::print("{}: {} rays\n", driver(), counts_.rays);
        for (std::size_t i = 0; i < kFaultCount; ++i)
            fmt::print("{:20}{:10}\n", name_of(static_cast<Fault>(i)), counts_.faults[i]);
        for (const std::string& text : texts_)
            if (!text.empty()) fmt::print("\n{}", text);
    }

private:
    // Enough for a kernel, and little beside the mesh.
    static constexpr std::size_t kRays = 256;
    // Reproducers that are tried for each kind.
    static constexpr int kMostShrunk = 5;

    void keep_smallest(std::uint64_t seed, const PosedMesh& mesh, const std::vector<Ray>& rays,
                       const Finding& finding) {
        const auto kind = static_cast<std::size_t>(finding.fault);
        if (shrunk_[kind] == kMostShrunk) return;
        const auto part = shrink(*driver_, *ours_, mesh, rays[finding.ray], finding, [] {});
        if (!part) return;
        ++shrunk_[kind];
        const std::size_t size = part->topology.triangles.size();
        if (!texts_[kind].empty() && size >= sizes_[kind]) return;
        sizes_[kind] = size;
        texts_[kind] = text_of(*part, fmt::format("generated case {}", seed), driver());
    }

    std::unique_ptr<DriverRays> driver_;
    std::unique_ptr<Backend> ours_;
    SuspectCounts counts_;
    std::array<int, kFaultCount> shrunk_{};
    std::array<std::size_t, kFaultCount> sizes_{};
    std::array<std::string, kFaultCount> texts_;
};

int run(const DriverFuzzOptions& options) {
    DriverFuzz fuzz(options.vulkan);
    for (std::uint64_t i = 0; i < options.cases; ++i) fuzz.judge(case_seed(options.seed, i));
    fuzz.print();
    return 0;
}

}  // namespace
}  // namespace mray::fuzz

int main(int argc, char** argv) {
    constexpr const char* kUsage = "usage: driver_fuzz [--seed S] [--cases N] [--device NAME]\n";
    if (argc == 2 && std::string(argv[1]) == "--help") {
        std::fputs(kUsage, stdout);
        return 0;
    }
    const auto options = mray::fuzz::read_options(argc, argv);
    if (!options) {
        std::fputs(kUsage, stderr);
        return 2;
    }
    try {
        return mray::fuzz::run(*options);
    } catch (const mray::Error& error) {
        fmt::print(stderr, "driver_fuzz: {}\n", error.what());
        return error.kind() == mray::ErrorKind::kUnavailable ? 4 : 70;
    }
}
