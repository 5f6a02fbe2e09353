// A report whose memory does not suffice ends with bad_alloc, whichever allocation fails. This test
// replaces operator new, so it has a program to itself.
#include <gtest/gtest.h>

#include <new>
#include <string>

#include "tests/support/failing_new.h"
#include "tools/text/json_writer.h"

namespace mray {
namespace {

using test::allocations_left;

/// Longer than what a string holds without memory of its own.
std::string long_text(char letter) { return std::string(40, letter); }

std::string report() {
    Json json = {{"variant", long_text('a')}, {"frame", 1.5}, {"list", {1, 2, 3}}, {"equal", true}};
    json["nested"] = {{"name", long_text('b')}, {"texts", {long_text('c'), long_text('d')}}};
    json["rows"] = Json::array();
    for (int i = 0; i < 3; ++i) json["rows"].push_back({{"name", long_text('e')}, {"row", i}});
    return json_text(json);
}

TEST(JsonMemory, ReportsSurviveAnyFailedAllocation) {
    const std::string expected = report();
    long failed = 0;
    for (long allocation = 0;; ++allocation) {
        allocations_left = allocation;
        std::string text;
        bool has_failed = false;
        try {
            text = report();
        } catch (const std::bad_alloc&) {
            has_failed = true;
        }
        allocations_left = -1;
        if (!has_failed) {
            EXPECT_EQ(text, expected);
            break;
        }
        ++failed;
    }
    EXPECT_GT(failed, 50);
}

}  // namespace
}  // namespace mray
