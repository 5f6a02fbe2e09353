#include "common/report/json_writer.h"

#include <gtest/gtest.h>

#include <limits>

namespace mray {
namespace {

std::string line(const Json& json) { return json_text(json, -1); }

TEST(JsonWriter, DoublesHaveTheFewestDigitsThatGiveThemBack) {
    EXPECT_EQ(line(0.0), "0.0\n");
    EXPECT_EQ(line(-0.0), "-0.0\n");
    EXPECT_EQ(line(1.0), "1.0\n");
    EXPECT_EQ(line(0.1), "0.1\n");
    EXPECT_EQ(line(1e-5), "1e-05\n");
    EXPECT_EQ(line(1e-7), "1e-07\n");
    EXPECT_EQ(line(1e300), "1e+300\n");
    EXPECT_EQ(line(999999999999999.0), "999999999999999.0\n");
    EXPECT_EQ(line(9007199254740992.0), "9.007199254740992e+15\n");
    EXPECT_EQ(line(0.1F), "0.10000000149011612\n");
    EXPECT_EQ(line(std::numeric_limits<double>::denorm_min()), "5e-324\n");
}

TEST(JsonWriter, NumbersThatAreNotFiniteBecomeNull) {
    EXPECT_EQ(line(std::numeric_limits<double>::quiet_NaN()), "null\n");
    EXPECT_EQ(line(-std::numeric_limits<float>::infinity()), "null\n");
}

TEST(JsonWriter, NumbersKeepTheirKind) {
    EXPECT_EQ(line(0), "0\n");
    EXPECT_EQ(line(-7), "-7\n");
    EXPECT_EQ(line(std::numeric_limits<std::int64_t>::min()), "-9223372036854775808\n");
    EXPECT_EQ(line(std::numeric_limits<std::uint64_t>::max()), "18446744073709551615\n");
    EXPECT_EQ(line(std::uint64_t{1} << 53), "9007199254740992\n");
    EXPECT_EQ(line(true), "true\n");
    EXPECT_EQ(line(nullptr), "null\n");
}

TEST(JsonWriter, TextsAreEscaped) {
    EXPECT_EQ(line("a\"b\\c/d"), "\"a\\\"b\\\\c/d\"\n");
    EXPECT_EQ(line(std::string("\b\f\n\r\t\0\x1f\x7f", 8)),
              "\"\\b\\f\\n\\r\\t\\u0000\\u001f\x7f\"\n");
    EXPECT_EQ(line("\xc3\xa9 \xf0\x9f\x98\x80"), "\"\xc3\xa9 \xf0\x9f\x98\x80\"\n");
    EXPECT_EQ(line({{"\n", 1}}), "{\"\\n\":1}\n");
}

TEST(JsonWriter, BytesThatAreNotUtf8AreReplaced) {
    EXPECT_EQ(line("a\xff"
                   "b"),
              "\"a\xef\xbf\xbd"
              "b\"\n");
    EXPECT_EQ(line("\xc3"), "\"\xef\xbf\xbd\"\n");
}

TEST(JsonWriter, MembersStayInOrder) {
    Json json = {{"z", 1}, {"a", 2}};
    json["m"] = 3;
    json["z"] = Json::array();
    json["b"]["c"] = "d";
    json["z"].push_back({{"k", 1}});
    json["z"].back()["j"] = 2;
    EXPECT_EQ(line(json), "{\"z\":[{\"k\":1,\"j\":2}],\"a\":2,\"m\":3,\"b\":{\"c\":\"d\"}}\n");
    json = {{"z", 1}, {"a", 2}};
    json.update({{"a", 3}, {"b", 4}});
    EXPECT_EQ(line(json), "{\"z\":1,\"a\":3,\"b\":4}\n");
}

}  // namespace
}  // namespace mray
