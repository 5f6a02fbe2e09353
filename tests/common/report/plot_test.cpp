// Figures that gnuplot draws from a CSV file, and what is said where it cannot.
#include "common/report/plot.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>

#include "common/base/errors.h"
#include "tests/support/temporary_folder.h"

namespace mray::plot {
namespace {

constexpr const char* kCsv = "name,x,y\na,0,1\na,10,100\nb c,10,0\nb c,1000,50\n";

Figure figure_of(const char* kind) {
    return {.title = "it's 'one' \"two\" $three `four`",
            .panels = {{.kind = kind, .x = "x", .y = "\"y\"", .series = "name", .logx = "10"}}};
}

/// Replaces PATH while it lives.
class OtherPath {
public:
    explicit OtherPath(const std::string& path) : old_(getenv("PATH")) {
        setenv("PATH", path.c_str(), 1);
    }
    ~OtherPath() { setenv("PATH", old_.c_str(), 1); }

private:
    std::string old_;
};

TEST(Plot, DrawsTitlesNamesAndAPlaceForZero) {
    for (const char* kind : {"lines", "points", "bars"}) {
        const std::string svg = draw(figure_of(kind), kCsv, "svg");
        EXPECT_NE(svg.find("<svg"), std::string::npos);
        EXPECT_NE(svg.find("$three `four`"), std::string::npos) << kind;
        EXPECT_NE(svg.find("b c"), std::string::npos) << kind;
        EXPECT_EQ(svg.find("none<") != std::string::npos, kind != std::string("bars"));
        EXPECT_EQ(draw(figure_of(kind), kCsv, "png").substr(1, 3), "PNG");
    }
}

TEST(Plot, SaysThatGnuplotFails) {
    const test::TemporaryFolder folder;
    folder.write("gnuplot", "#!/bin/sh\nexit 1\n");
    std::filesystem::permissions(folder.file("gnuplot"), std::filesystem::perms::owner_all);
    const OtherPath path(folder.path().string() + ":/bin:/usr/bin");
    try {
        draw({.title = "Trees"}, kCsv, "svg");
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kInternal);
        EXPECT_STREQ(error.what(), "Trees: gnuplot failed; its message is above");
    }
}

TEST(Plot, SaysThatGnuplotIsMissing) {
    const OtherPath path("/nowhere");
    try {
        require_gnuplot("chart");
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::kUnavailable);
        EXPECT_STREQ(error.what(),
                     "chart: gnuplot is not installed; install the package gnuplot-nox");
    }
}

}  // namespace
}  // namespace mray::plot
