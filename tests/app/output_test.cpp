// Outputs that cannot be written: exit code 5, before any work if possible, and no file left.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/app/program.h"

namespace mray::test {
namespace {

std::vector<std::string> render(const TemporaryFolder& folder, std::vector<std::string> more = {}) {
    std::vector<std::string> all = {"render", "builtin:cloth:500", "--backend", "cpu", "--size",
                                    "16x16",  "--frames",          "0..1"};
    const bool has_out = std::find(more.begin(), more.end(), "--out") != more.end();
    if (!has_out) all.insert(all.end(), {"--out", folder.file("out")});
    all.insert(all.end(), more.begin(), more.end());
    return all;
}

void expect_output_error(const Outcome& outcome, const std::string& begins) {
    EXPECT_EQ(outcome.code, 5) << outcome.err;
    ASSERT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with(begins)) << outcome.err;
    EXPECT_NE(outcome.err.find("; "), std::string::npos) << outcome.err;
}

TEST(Output, FolderThatIsAFileIsRefused) {
    TemporaryFolder folder;
    const std::string file = folder.write("file", "x");
    expect_output_error(run(render(folder, {"--out", file})), file + ": ");
    expect_output_error(run(render(folder, {"--out", file + "/deeper"})), file);
    EXPECT_EQ(folder.names(), std::vector<std::string>{"file"});
    EXPECT_EQ(read_file(file), "x");
}

TEST(Output, ReportInAMissingFolderIsRefusedBeforeTheScene) {
    TemporaryFolder folder;
    const std::string name = folder.file("none/report");
    // The scene does not exist either; the error is about the output.
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"crosscheck", "none.obj", "--json", name},
          std::vector<std::string>{"crosscheck", "none.obj", "--junit", name},
          std::vector<std::string>{"profile", "none.obj", "--csv", name},
          std::vector<std::string>{"profile", "none.obj", "--json", name},
          std::vector<std::string>{"info", "none.obj", "--json", name},
          std::vector<std::string>{"devices", "--json", name},
          std::vector<std::string>{"query", "none.obj", "--points", "none", "--ask", "inside",
                                   "--out", name},
          std::vector<std::string>{"trace", "none.obj", "--rays", "none", "--out", name}}) {
        expect_output_error(run(arguments, {.folder = folder.path()}), name + ": ");
        EXPECT_TRUE(folder.names().empty()) << arguments[0];
    }
}

TEST(Output, ReportsMayLieInTheFolderOfTheImages) {
    TemporaryFolder folder;
    const Outcome outcome = run(
        render(folder, {"--json", folder.file("out/report"), "--hits", folder.file("out/hits")}));
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_TRUE(std::filesystem::exists(folder.file("out/report")));
    EXPECT_TRUE(std::filesystem::exists(folder.file("out/hits")));
    // Nothing remains of a run that fails.
    EXPECT_EQ(run(render(folder, {"--out", folder.file("b"), "--json", folder.file("b/report"),
                                  "--fov", "0"}))
                  .code,
              3);
    EXPECT_FALSE(std::filesystem::exists(folder.file("b")));
}

TEST(Output, FullDiskIsAnError) {
    TemporaryFolder folder;
    expect_output_error(run(render(folder, {"--json", "/dev/full", "-q"})), "/dev/full: ");
    expect_output_error(run(render(folder, {"--hits", "/dev/full", "-q"})), "/dev/full: ");
    expect_output_error(run({"trace", "builtin:cloth:500", "--rays", "-", "--out", "/dev/full"},
                            {.input = "0 9 0 0 -1 0\n"}),
                        "/dev/full: ");
}

TEST(Output, OneReportThatCannotBeWrittenLosesNoOther) {
    TemporaryFolder folder;
    const auto expect_rest = [&](std::vector<std::string> command, const std::string& begins,
                                 const std::vector<std::string>& files) {
        command.insert(command.end(), {"--json", "/dev/full"});
        const Outcome outcome = run(command);
        expect_output_error(outcome, "/dev/full: ");
        EXPECT_TRUE(outcome.out.starts_with(begins)) << command[0] << ": " << outcome.out;
        for (const std::string& file : files) EXPECT_FALSE(read_file(file).empty()) << file;
    };
    const std::vector<std::string> names = {folder.file("r.xml"), folder.file("r.html"),
                                            folder.file("t.csv"), folder.file("p.csv"),
                                            folder.file("hits")};
    expect_rest({"crosscheck", "builtin:cloth:200", "--backend", "cpu", "--simd", "off", "--size",
                 "8x8", "--frames", "0", "--junit", names[0], "--html", names[1]},
                "variant", {names[0], names[1]});
    expect_rest({"profile", "builtin:cloth:200", "--backend", "cpu", "--size", "8x8", "--frames",
                 "0", "--repeat", "1", "--csv", names[2]},
                "refit", {names[2]});
    expect_rest({"profile", "builtin:cloth:200", "--backend", "cpu", "--size", "8x8", "--frames",
                 "0..1", "--repeat", "1", "--policies", "refit", "--csv", names[3]},
                "quickest", {names[3]});
    expect_rest(render(folder, {"--hits", names[4]}), "frame", {names[4]});
    expect_rest({"info", "builtin:cloth:200"}, "scene", {});
}

TEST(Output, APlotThatCannotBeDrawnLosesNoReport) {
    TemporaryFolder folder;
    const Outcome outcome = run({"profile", "builtin:cloth:200", "--backend", "cpu", "--size",
                                 "8x8", "--frames", "0..1", "--repeat", "1", "--policies", "refit",
                                 "--plot", folder.file("p.svg"), "--csv", folder.file("p.csv")},
                                {.environment = {"TMPDIR=/none"}});
    if (outcome.code == 4) GTEST_SKIP() << "without gnuplot";
    EXPECT_EQ(outcome.code, 5) << outcome.err;
    EXPECT_NE(outcome.err.find("set TMPDIR"), std::string::npos) << outcome.err;
    EXPECT_EQ(folder.names(), std::vector<std::string>{"p.csv"});
}

TEST(Output, TwoOutputsToOnePlaceAreRefused) {
    TemporaryFolder folder;
    const std::string one = folder.file("one.png");
    const std::string same = folder.file("none/../one.png");
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"crosscheck", "none.obj", "--json", one, "--junit", same},
          std::vector<std::string>{"crosscheck", "none.obj", "--json", "-", "--html", "-"},
          std::vector<std::string>{"profile", "none.obj", "--csv", one, "--json", same},
          std::vector<std::string>{"profile", "none.obj", "--csv", "-", "--json", "/dev/stdout"},
          render(folder, {"--json", one, "--hits", one}),
          render(folder, {"--json", folder.file("out/frame_0001.png")})}) {
        const Outcome outcome = run(arguments);
        EXPECT_EQ(outcome.code, 2) << outcome.err;
        EXPECT_NE(outcome.err.find("two outputs go to "), std::string::npos) << outcome.err;
        EXPECT_TRUE(folder.names().empty());
    }
}

TEST(Output, FullStdoutIsAnError) {
    TemporaryFolder folder;
    expect_output_error(run({"info"}, {.stdout_to = "/dev/full"}), "/dev/stdout: ");
    expect_output_error(run({"--help"}, {.stdout_to = "/dev/full"}), "/dev/stdout: ");
    expect_output_error(run(render(folder), {.stdout_to = "/dev/full"}), "/dev/stdout: ");
}

TEST(Output, ClosedStdoutIsAnErrorAndReceivesNoOtherFile) {
    TemporaryFolder folder;
    expect_output_error(run({"info"}, {.stdout_closed = true}), "/dev/stdout: ");
    // The table must not end in an image that was opened as descriptor 1.
    const Outcome outcome = run(render(folder), {.stdout_closed = true});
    EXPECT_EQ(outcome.code, 5);
    const std::string png = read_file(folder.path() / "out/frame_0000.png");
    EXPECT_TRUE(png.starts_with("\x89PNG"));
    EXPECT_EQ(png.find("frame "), std::string::npos);
}

TEST(Output, FailureLeavesNoFolder) {
    TemporaryFolder folder;
    const std::string nested = folder.file("a/b/c");
    EXPECT_EQ(run(render(folder, {"--out", nested, "--fov", "0"})).code, 3);
    EXPECT_EQ(run({"render", "none.obj", "--out", nested}, {.folder = folder.path()}).code, 3);
    EXPECT_EQ(run({"render", "builtin:none", "--out", nested}).code, 2);
    EXPECT_TRUE(folder.names().empty());
}

TEST(Output, JsonIsTheOnlyTextOnStdout) {
    TemporaryFolder folder;
    const std::vector<std::string> view = {"builtin:cloth:500", "--backend", "cpu", "--size",
                                           "16x16"};
    const auto with_view = [&](std::vector<std::string> first, std::vector<std::string> more) {
        first.insert(first.end(), view.begin(), view.end());
        first.insert(first.end(), more.begin(), more.end());
        return first;
    };
    std::vector<std::vector<std::string>> commands = {
        render(folder),
        with_view({"crosscheck"}, {"--frames", "0", "--junit", folder.file("report.xml")}),
        with_view({"profile"}, {"--frames", "0", "--repeat", "1", "--csv", folder.file("t.csv")}),
        {"info", "builtin:cloth:500", "--bvh"}};
    for (const char* to : {"-", "/dev/stdout"}) {
        for (std::vector<std::string> command : commands) {
            command.insert(command.end(), {"--json", to});
            const Outcome outcome = run(command);
            EXPECT_EQ(outcome.code, 0) << command[0] << ": " << outcome.err;
            EXPECT_TRUE(nlohmann::json::accept(outcome.out)) << command[0] << ": " << outcome.out;
        }
    }
}

}  // namespace
}  // namespace mray::test
