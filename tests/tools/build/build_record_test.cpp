#include "tools/build/build_record.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

namespace mray {
namespace {

TEST(BuildRecord, NamesCompilerAndCMake) {
    EXPECT_TRUE(build_compiler().starts_with("g++ ") || build_compiler().starts_with("clang "));
    EXPECT_EQ(build_cmake().find_first_not_of("0123456789.-rc"), std::string_view::npos);
    EXPECT_EQ(std::ranges::count(build_cmake(), '.'), 2);
}

TEST(BuildRecord, PackagesAreInOrderAndHaveVersions) {
    const auto packages = build_packages();
    EXPECT_TRUE(std::ranges::is_sorted(packages, {}, &BuildPackage::name));
    EXPECT_EQ(std::ranges::adjacent_find(packages, {}, &BuildPackage::name), packages.end());
    for (const BuildPackage& package : packages) {
        EXPECT_FALSE(package.version.empty()) << package.name;
        EXPECT_EQ(package.version.find(' '), std::string_view::npos) << package.name;
    }
}

TEST(BuildRecord, TextAndJsonHaveAll) {
    const std::string text = build_record_text();
    EXPECT_NE(text.find(build_compiler()), std::string::npos);
    const auto json = nlohmann::json::parse(json_text(build_record_json()));
    EXPECT_EQ(json["compiler"], build_compiler());
    EXPECT_EQ(json["cmake"], build_cmake());
    EXPECT_EQ(json["packages"].size(), build_packages().size());
    for (const BuildPackage& package : build_packages()) {
        EXPECT_EQ(json["packages"][std::string(package.name)], package.version);
        EXPECT_NE(text.find(package.version), std::string::npos) << package.name;
    }
}

}  // namespace
}  // namespace mray
