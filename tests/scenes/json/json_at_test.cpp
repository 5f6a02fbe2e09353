#include "scenes/json/json_at.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace mray {
namespace {

const std::string kFile = "x.json";

/// The message of the error that a call throws.
template <class Call>
std::string refusal(Call call) {
    try {
        call();
    } catch (const JsonValueError& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kBadInput);
        return error.what();
    }
    return "none";
}

TEST(JsonAt, ValuesAreReadByPath) {
    const JsonTree tree = parse_json(R"({"a": [1.5, {"b": "text"}, true, null], "n": 3})");
    const JsonAt root(tree, kFile);
    const JsonAt list = root.at("a");
    EXPECT_TRUE(root.is_object());
    EXPECT_TRUE(list.is_array());
    ASSERT_EQ(list.size(), 4u);
    EXPECT_EQ(list[0].number(), 1.5);
    EXPECT_EQ(list[1].at("b").text(), "text");
    EXPECT_EQ(list[1].at("b").path(), "a[1].b");
    EXPECT_TRUE(list[2].boolean());
    EXPECT_TRUE(list[3].is_null());
    EXPECT_EQ(root.at("n").count(), 3u);
    EXPECT_FALSE(root.find("m"));
}

TEST(JsonAt, ErrorsNameFileAndPlace) {
    const JsonTree tree = parse_json(R"({"a": [{"b": "text"}]})");
    const JsonAt root(tree, kFile);
    EXPECT_EQ(refusal([&] { root.at("c"); }), "x.json: has no member c");
    EXPECT_EQ(refusal([&] { root.at("a")[0].at("c"); }), "x.json: a[0]: has no member c");
    EXPECT_EQ(refusal([&] { root.at("a")[0].at("b").number(); }),
              "x.json: a[0].b: must be a number");
    EXPECT_EQ(refusal([&] { root.at("a").at("b"); }), "x.json: a: must be an object");
    EXPECT_EQ(refusal([&] { root.at("a")[1]; }), "x.json: a: has 1 elements, and none at 1");
    EXPECT_EQ(refusal([&] { root[0]; }), "x.json: must be an array");
}

TEST(JsonAt, UnsignedIntegersAreWrittenAsSuch) {
    const auto read = [](const char* text) {
        const JsonTree tree = parse_json(text);
        return JsonAt(tree, kFile).unsigned_integer();
    };
    EXPECT_EQ(read("0"), 0u);
    EXPECT_EQ(read("18446744073709551615"), 18446744073709551615u);
    for (const char* text : {"18446744073709551616", "-1", "-0", "1.0", "1e3", "\"1\"", "true"})
        EXPECT_FALSE(read(text)) << text;
}

TEST(JsonAt, TextsThatAreNotJsonAreRefusedWithTheByte) {
    for (const auto& [text, byte] :
         std::vector<std::pair<const char*, std::size_t>>{{"", 1}, {"[1,\n x]", 6}, {"[1", 3}}) {
        try {
            parse_json(text);
            ADD_FAILURE() << text;
        } catch (const JsonSyntaxError& error) {
            EXPECT_EQ(error.byte(), byte) << text;
        }
    }
    EXPECT_EQ(refusal([] { parse_json("[1e999]"); }), "JSON has a number that is too large");
}

}  // namespace
}  // namespace mray
