#include "common/bvh/split.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "common/base/aligned_vector.h"
#include "tests/support/test_scene.h"

namespace morphray {
namespace {

using test::Random;

/// Boxes of any size in a region that may be flat or a point; some are empty.
AlignedVector<PrimRef> random_refs(Random& random, std::uint32_t count) {
    vec3 region;
    for (int axis = 0; axis < 3; ++axis)
        region[axis] = random.below(4) == 0 ? 0 : std::ldexp(1.0f, random.below(20));
    const float size = std::ldexp(1.0f, static_cast<int>(random.below(20)) - 5);
    const bool in_steps = random.below(3) == 0;
    AlignedVector<PrimRef> refs;
    for (std::uint32_t id = 0; id < count; ++id) {
        Box4 box = Box4::none();
        for (int i = 0; i < 3 && random.below(100) != 0; ++i) {
            vec3 p = random.point() * region + (i == 0 ? vec3(0, 0, 0) : random.point(size));
            if (in_steps) p = {std::round(p.x), std::round(p.y), std::round(p.z)};
            box.extend(load3(snap_point(p)));
        }
        refs.push_back(PrimRef(box, id));
    }
    return refs;
}

TEST(Splits, HaveTheSameResultForRegistersOfAnyWidth) {
    using SplitFunction = std::size_t (*)(std::span<const PrimRef>, PrimRef*);
    Random random(1);
    std::size_t divided = 0;
    const auto expect_same = [&](SplitFunction best, SplitFunction four, std::uint32_t count) {
        const AlignedVector<PrimRef> refs = random_refs(random, count);
        AlignedVector<PrimRef> by_best(count, PrimRef(Box4::none(), 0));
        AlignedVector<PrimRef> by_four(count, PrimRef(Box4::none(), 0));
        const std::size_t left = best(refs, by_best.data());
        ASSERT_EQ(left, four(refs, by_four.data()));
        ASSERT_EQ(std::memcmp(by_best.data(), by_four.data(), count * sizeof(PrimRef)), 0);
        divided += left != 0;
    };
    for (int round = 0; round < 600; ++round) {
        const std::uint32_t many = 16000 + random.below(30000);
        expect_same(split_binned, split_binned_in_four_lanes,
                    round % 40 == 0 ? many : 2 + random.below(round % 2 == 0 ? 60 : 2000));
        expect_same(split_few, split_few_in_four_lanes, 2 + random.below(kFewRefs - 1));
    }
    EXPECT_GT(divided, 800u);
}

}  // namespace
}  // namespace morphray
