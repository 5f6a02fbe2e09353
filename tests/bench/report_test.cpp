#include "bench/report.h"

#include <gtest/gtest.h>

namespace mray::bench {
namespace {

ReportHead head_with(const std::string& left_out) {
    return {"machine", "AVX2", "4.3.3", left_out, "0.1.0", "./bench/run"};
}

TEST(BenchReport, CsvSaysWhichWaysEmbreeLacks) {
    const std::string csv = to_csv(head_with("streams (Intersect1M, Occluded1M)"), {});
    EXPECT_TRUE(
        csv.starts_with("# machine, AVX2; morphray 0.1.0, Embree 4.3.3, which has no "
                        "streams (Intersect1M, Occluded1M)\n# ./bench/run\nscene,"))
        << csv;
}

TEST(BenchReport, CsvSaysNothingIfEmbreeLacksNoWay) {
    const std::string csv = to_csv(head_with(""), {});
    EXPECT_TRUE(csv.starts_with("# machine, AVX2; morphray 0.1.0, Embree 4.3.3\n# ./bench/run\n"))
        << csv;
}

TEST(BenchReport, JsonNamesTheWaysThatEmbreeLacks) {
    EXPECT_NE(to_json(head_with("streams"), {}).find("\"left_out\": \"streams\""),
              std::string::npos);
}

}  // namespace
}  // namespace mray::bench
