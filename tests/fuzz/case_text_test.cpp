// Cases read back as they were.
#include <gtest/gtest.h>

#include <bit>
#include <limits>
#include <string>
#include <vector>

#include "common/base/errors.h"
#include "tests/fuzz/generate/generate.h"
#include "tests/support/same_bits.h"

namespace mray::fuzz {
namespace {

TEST(CaseText, ReadsBackBitForBit) {
    using Limits = std::numeric_limits<float>;
    std::vector<FuzzCase> cases(1);
    FuzzCase& special = cases.front();
    special.triangles = {{0, 1, 2}};
    special.poses = {{{Limits::quiet_NaN(), -Limits::infinity(), -0.0f},
                      {std::bit_cast<float>(0xFFC12345u), Limits::denorm_min(), Limits::max()},
                      {-Limits::denorm_min(), 0.1f, 1e-40f}}};
    special.view.eye = Point{-0.0, 5e-324, 0.1};
    special.rays = {{{1, 2, 3}, {0, -0.0, 1e-300}, 0, std::numeric_limits<double>::infinity()}};
    for (std::uint64_t seed = 0; seed < 200; ++seed)
        cases.insert(cases.end(), {make_case(seed), make_questions(seed)});
    for (const FuzzCase& made : cases) {
        const FuzzCase read = read_case(to_text(made, "a remark\nof two lines"), "made");
        ASSERT_EQ(to_text(read), to_text(made));
        for (std::size_t pose = 0; pose < made.poses.size(); ++pose)
            ASSERT_TRUE(test::same_bytes(read.poses[pose], made.poses[pose]));
        ASSERT_TRUE(test::same_bytes(read.rays, made.rays));
        ASSERT_TRUE(test::same_bytes(read.points, made.points));
        ASSERT_EQ(read.asks_questions, made.asks_questions);
    }
}

TEST(CaseText, NamesTheLineOfWhatItCannotRead) {
    for (const char* text : {"size 4 4\nsize 4", "# x\nv 1 2 3", "# x\nfov 1x", "t 0 0 0\nw 1"}) {
        try {
            read_case(text, "broken.txt");
            FAIL() << text;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::kBadInput);
            EXPECT_TRUE(std::string(error.what()).starts_with("broken.txt:2: ")) << error.what();
        }
    }
}

}  // namespace
}  // namespace mray::fuzz
