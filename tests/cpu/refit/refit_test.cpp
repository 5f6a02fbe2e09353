#include "cpu/refit/refit.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <new>
#include <span>

#include "common/bvh/box.h"
#include "common/bvh/builder/bvh_builder.h"
#include "tests/support/test_scene.h"
#include "tests/support/tree_check.h"

namespace mray {
namespace {

using namespace test;

std::vector<vec3> moved(const std::vector<vec3>& positions, std::uint64_t seed) {
    Random random(seed);
    std::vector<vec3> result = positions;
    for (vec3& p : result) {
        const vec3 q = p + random.point(0.1 * kSceneExtent);
        if (std::max({std::abs(q.x), std::abs(q.y), std::abs(q.z)}) <= kSceneExtent)
            p = snap_point(q);
    }
    return result;
}

TEST(Refit, KeepsEveryInvariantAndComesBackToTheBytesOfTheBuild) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const std::uint64_t built = bvh_hash(bvh);
        const std::vector<vec3> nowhere(scene.positions().size(), vec3(kInvalidCoordinate));
        for (const std::vector<vec3>& positions : {moved(scene.positions(), 3), nowhere}) {
            cpu::refit(bvh, positions);
            EXPECT_EQ(bvh_hash(bvh) != built, positions != scene.positions()) << named.name;
            EXPECT_EQ(check_bvh(bvh, scene.topology(), positions), std::vector<std::string>{})
                << named.name;
        }
        cpu::refit(bvh, scene.positions());
        EXPECT_EQ(bvh_hash(bvh), built) << named.name;
    }
}

TEST(Refit, GivesTheSameBytesForEveryTarget) {
    for (const NamedScene& named : adversarial_scenes()) {
        const TestScene& scene = named.scene;
        const Bvh built = build_bvh(scene.topology(), scene.positions());
        std::vector<vec3> positions = moved(scene.positions(), 7);
        if (positions.size() > 2) positions[2] = scene.space().to_scene({0, NAN, 0});
        MovedParts all;
        for (std::uint32_t i = 0; i < built.leaves.size(); ++i) all.leaves.push_back(i);
        for (std::uint32_t i = 0; i < built.nodes.size(); ++i) all.nodes.push_back(i);
        Bvh expected = built;
        const cpu::RefitArrays tree(expected);
        for (const std::uint32_t leaf : all.leaves) cpu::refit_leaf(tree, leaf, positions);
        for (std::size_t i = all.nodes.size(); i-- > 0;) cpu::refit_node(tree, all.nodes[i]);
        for (const SimdTarget& target : supported_simd_targets()) {
            Bvh whole = built;
            cpu::refit(whole, positions, target);
            EXPECT_EQ(bvh_hash(whole), bvh_hash(expected)) << named.name << ", " << target.name;
            Bvh in_parts = built;
            cpu::refit(in_parts, positions, target, &all);
            EXPECT_EQ(bvh_hash(in_parts), bvh_hash(expected)) << named.name << ", " << target.name;
        }
    }
}

/// A copy of positions that ends with a page, after which no byte may be read.
class PositionsBeforeAGap {
public:
    explicit PositionsBeforeAGap(std::span<const vec3> positions) {
        const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
        const std::size_t pages = positions.size_bytes() / page + 1;
        size_ = (pages + 1) * page;
        memory_ = mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (memory_ == MAP_FAILED) throw std::bad_alloc();
        std::byte* const gap = static_cast<std::byte*>(memory_) + pages * page;
        mprotect(gap, page, PROT_NONE);
        vec3* const first = reinterpret_cast<vec3*>(gap - positions.size_bytes());
        std::copy(positions.begin(), positions.end(), first);
        positions_ = {first, positions.size()};
    }
    ~PositionsBeforeAGap() { munmap(memory_, size_); }
    PositionsBeforeAGap(const PositionsBeforeAGap&) = delete;
    PositionsBeforeAGap& operator=(const PositionsBeforeAGap&) = delete;

    std::span<const vec3> get() const { return positions_; }

private:
    std::size_t size_ = 0;
    void* memory_ = nullptr;
    std::span<const vec3> positions_;
};

TEST(Refit, ReadsNothingBeyondTheLastVertex) {
    for (const TestScene& scene :
         {torus(30, 10), random_soup(1, 0.1, 1), random_soup(500, 0.1, 2)}) {
        const PositionsBeforeAGap positions(scene.positions());
        Bvh bvh = build_bvh(scene.topology(), scene.positions());
        const std::uint64_t built = bvh_hash(bvh);
        for (const SimdTarget& target : supported_simd_targets()) {
            cpu::refit(bvh, positions.get(), target);
            EXPECT_EQ(bvh_hash(bvh), built) << target.name;
        }
    }
}

}  // namespace
}  // namespace mray
