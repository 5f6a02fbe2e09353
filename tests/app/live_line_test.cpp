// The line of progress on a terminal, and rows of tables as they are made.
#include <gtest/gtest.h>
#include <signal.h>

#include "tests/app/program.h"

namespace mray::test {
namespace {

constexpr const char* kClearLine = "\r\x1b[K";

struct LongCommand {
    std::vector<std::string> arguments;
    /// Matches a line of progress.
    std::string line;
};

// Each takes long enough to be seen at work, on any machine.
std::vector<LongCommand> long_commands(const TemporaryFolder& folder) {
    const std::string cloth = "builtin:cloth:20000";
    const std::string soup = "builtin:soup:4000000";
    return {
        {{"render", cloth, "--backend", "brute", "--size", "1024x1024", "--rays", "shadow",
          "--frames", "3..24", "--out", folder.file("images")},
         R"(rendering \d+/22  frame \d+, \d+%, \d\d:\d\d:\d\d to go)"},
        {{"render", soup, "--threads", "1", "--size", "8x8", "--frame", "0", "--out",
          folder.file("image")},
         R"(rendering 0/1  tree)"},
    };
}

TEST(LiveLine, ShowsTheStepAndIsClearedBeforeTheMessage) {
    const TemporaryFolder folder;
    for (const LongCommand& command : long_commands(folder)) {
        Started started(command.arguments,
                        {.environment = {"TERM=xterm", "NO_COLOR=1"}, .on_terminal = true});
        started.wait_for_err(command.line);
        started.send(SIGTERM);
        const Outcome outcome = started.wait();
        EXPECT_EQ(outcome.code, 143) << outcome.err;
        EXPECT_EQ(outcome.out, "");
        // A single line at the end, of which nothing is left but the message.
        const std::size_t cleared = outcome.err.rfind(kClearLine);
        ASSERT_NE(cleared, std::string::npos);
        const std::string message = outcome.err.substr(cleared + 4);
        EXPECT_TRUE(message.starts_with("morphray: terminated; ")) << outcome.err;
        EXPECT_EQ(message.find('\n'), message.size() - 1) << message;
        EXPECT_EQ(outcome.err.find('\n'), outcome.err.size() - 1) << outcome.err;
    }
}

TEST(Rows, AreWrittenAsFramesAreMade) {
    const TemporaryFolder folder;
    const std::string out = folder.file("out");
    // A fraction of a second a frame, and many frames.
    Started render({"render", "builtin:cloth:20000", "--backend", "brute", "--size", "128x128",
                    "--rays", "shadow", "--frames", "0,3..24", "--out", out});
    render.wait_for_out(R"(\n +3 .*\n)");
    render.send(SIGINT);
    const Outcome outcome = render.wait();
    EXPECT_EQ(outcome.code, 130);
    const std::vector<std::string> rows = lines(outcome.out);
    ASSERT_GE(rows.size(), 3u) << outcome.out;
    EXPECT_TRUE(rows[0].starts_with("frame  tree ")) << rows[0];
    EXPECT_TRUE(rows[1].starts_with("    0  build")) << rows[1];
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(out))
        files += entry.path().extension() == ".png" ? 1 : 0;
    // Each row is of a file that is there, and no file lacks one.
    EXPECT_EQ(files, rows.size() - 1);
    for (std::size_t i = 1; i < rows.size(); ++i)
        EXPECT_TRUE(std::filesystem::exists(rows[i].substr(rows[i].find(out)))) << rows[i];
    EXPECT_EQ(outcome.err, "morphray: interrupted; finished results are kept\n");
}

TEST(Rows, OfProfileEndNoReportIfTheyCannotBePrinted) {
    for (const std::vector<std::string>& policies :
         {std::vector<std::string>{}, {"--policies", "refit"}}) {
        const TemporaryFolder folder;
        std::vector<std::string> arguments = {"profile",   "builtin:cloth:500",
                                              "--backend", "cpu",
                                              "--size",    "8x8",
                                              "--frames",  "0..1",
                                              "--repeat",  "1",
                                              "--json",    folder.file("profile.json")};
        arguments.insert(arguments.end(), policies.begin(), policies.end());
        const Outcome outcome = run(arguments, {.stdout_to = "/dev/full"});
        EXPECT_EQ(outcome.code, 5) << outcome.err;
        EXPECT_TRUE(std::filesystem::exists(folder.file("profile.json")));
    }
}

}  // namespace
}  // namespace mray::test
