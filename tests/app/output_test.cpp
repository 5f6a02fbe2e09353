// Outputs that cannot be written: exit code 5, before any work if possible, and no file left.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/app/program.h"

namespace mray::test {
namespace {

Words render(const TemporaryFolder& folder, Words more = {}) {
    if (!std::ranges::count(more, "--out")) more.insert(more.end(), {"--out", folder.file("out")});
    return words("render builtin:cloth:500 --backend cpu --size 16x16 --frames 0..1", more);
}

void expect_output_error(const Outcome& outcome, const std::string& begins) {
    EXPECT_EQ(outcome.code, 5) << outcome.err;
    ASSERT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with(begins)) << outcome.err;
    EXPECT_TRUE(has(outcome.err, "; "));
}

TEST(Output, FolderThatIsAFileIsRefused) {
    TemporaryFolder folder;
    const std::string file = folder.write("file", "x");
    expect_output_error(run(render(folder, {"--out", file})), file + ": ");
    expect_output_error(run(render(folder, {"--out", file + "/deeper"})), file);
    EXPECT_EQ(folder.names(), Words{"file"});
    EXPECT_EQ(read_file(file), "x");
}

TEST(Output, ReportInAMissingFolderIsRefusedBeforeTheScene) {
    TemporaryFolder folder;
    const std::string name = folder.file("none/report");
    // The scene does not exist either; the error is about the output.
    for (const Words& arguments :
         {Words{"crosscheck", "none.obj", "--json", name},
          Words{"crosscheck", "none.obj", "--junit", name},
          Words{"profile", "none.obj", "--csv", name}, Words{"profile", "none.obj", "--json", name},
          Words{"info", "none.obj", "--json", name}, Words{"devices", "--json", name},
          Words{"query", "none.obj", "--points", "none", "--ask", "inside", "--out", name},
          Words{"trace", "none.obj", "--rays", "none", "--out", name}}) {
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
    const auto expect_rest = [&](Words command, const std::string& begins, const Words& files) {
        command.insert(command.end(), {"--json", "/dev/full"});
        const Outcome outcome = run(command);
        expect_output_error(outcome, "/dev/full: ");
        EXPECT_TRUE(outcome.out.starts_with(begins)) << command[0] << ": " << outcome.out;
        for (const std::string& file : files) EXPECT_FALSE(read_file(file).empty()) << file;
    };
    const Words names = {folder.file("r.xml"), folder.file("r.html"), folder.file("t.csv"),
                         folder.file("p.csv"), folder.file("hits")};
    expect_rest({"crosscheck", "builtin:cloth:200", "--backend", "cpu", "--simd", "off", "--size",
                 "8x8", "--frames", "0", "--junit", names[0], "--html", names[1]},
                "variant", {names[0], names[1]});
    expect_rest({"profile", "builtin:cloth:200", "--backend", "cpu", "--size", "8x8", "--frames",
                 "0", "--repeat", "1", "--csv", names[2]},
                "refit", {names[2]});
    expect_rest({"profile", "builtin:cloth:200", "--backend", "cpu", "--size", "8x8", "--frames",
                 "0..1", "--repeat", "1", "--policies", "refit", "--csv", names[3]},
                "refit ", {names[3]});
    expect_rest(render(folder, {"--hits", names[4]}), "frame", {names[4]});
    expect_rest({"info", "builtin:cloth:200"}, "scene", {});
}

TEST(Output, TwoOutputsToOnePlaceAreRefused) {
    TemporaryFolder folder;
    const std::string one = folder.file("one.png");
    const std::string same = folder.file("none/../one.png");
    for (const Words& arguments :
         {Words{"crosscheck", "none.obj", "--json", one, "--junit", same},
          Words{"crosscheck", "none.obj", "--json", "-", "--html", "-"},
          Words{"profile", "none.obj", "--csv", one, "--json", same},
          Words{"profile", "none.obj", "--csv", "-", "--json", "/dev/stdout"},
          render(folder, {"--json", one, "--hits", one}),
          render(folder, {"--json", folder.file("out/frame_0001.png")})}) {
        const Outcome outcome = run(arguments);
        EXPECT_EQ(outcome.code, 2) << outcome.err;
        EXPECT_TRUE(has(outcome.err, "two outputs go to "));
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
    EXPECT_FALSE(has(png, "frame "));
}

TEST(Output, JsonIsTheOnlyTextOnStdout) {
    TemporaryFolder folder;
    const std::string view = " builtin:cloth:500 --backend cpu --size 16x16 --frames 0 ";
    for (const char* to : {"-", "/dev/stdout"}) {
        for (const std::string& command :
             {"render" + view + "--out " + folder.file("out"),
              "crosscheck" + view + "--junit " + folder.file("report.xml"),
              "profile" + view + "--repeat 1 --csv " + folder.file("t.csv"),
              std::string("info builtin:cloth:500 --bvh")}) {
            const Outcome outcome = run(words(command, {"--json", to}));
            EXPECT_EQ(outcome.code, 0) << command << ": " << outcome.err;
            EXPECT_TRUE(nlohmann::json::accept(outcome.out)) << command << ": " << outcome.out;
        }
    }
}

}  // namespace
}  // namespace mray::test
