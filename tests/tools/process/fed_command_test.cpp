#include "tools/process/fed_command.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <stdexcept>
#include <string>

#include "tests/support/temporary_folder.h"

namespace mray {
namespace {

std::span<const std::byte> bytes_of(const std::string& text) {
    return std::as_bytes(std::span(text));
}

void write_nothing(const Feed&) {}

TEST(FedCommand, ReadsWhatItIsGiven) {
    const test::TemporaryFolder folder;
    const std::string file = folder.file("copy");
    const std::string text(1'000'000, 'x');
    const auto write = [&](const Feed& feed) {
        EXPECT_TRUE(feed(bytes_of("first ")));
        EXPECT_TRUE(feed(bytes_of(text)));
    };
    EXPECT_EQ(run_fed({"dd", "of=" + file, "bs=65536"}, write), 0);
    EXPECT_EQ(test::read_file(file), "first " + text);
}

TEST(FedCommand, TakesArgumentsAsTheyAre) {
    const test::TemporaryFolder folder;
    const std::string name = folder.file("a $(x) ; ' \" file");
    EXPECT_EQ(run_fed({"touch", name}, write_nothing), 0);
    EXPECT_TRUE(std::filesystem::exists(name));
}

TEST(FedCommand, SaysHowTheProgramEnded) {
    EXPECT_EQ(run_fed({"false"}, write_nothing), 1);
    EXPECT_EQ(run_fed({"sh", "-c", "kill -9 $$"}, write_nothing), -1);
    EXPECT_EQ(run_fed({"no_such_program_of_this_name"}, write_nothing), std::nullopt);
}

TEST(FedCommand, SaysThatTheProgramNoLongerReads) {
    struct sigaction before = {};
    struct sigaction ignore = {};
    ignore.sa_handler = SIG_IGN;
    sigaction(SIGPIPE, &ignore, &before);
    bool reads = true;
    const std::string text(65536, 'x');
    const auto write = [&](const Feed& feed) {
        for (int i = 0; i < 1000 && reads; ++i) reads = feed(bytes_of(text));
    };
    EXPECT_EQ(run_fed({"true"}, write), 0);
    EXPECT_FALSE(reads);
    sigaction(SIGPIPE, &before, nullptr);
}

TEST(FedCommand, IsEndedWhenTheWriterThrows) {
    const auto write = [](const Feed&) { throw std::runtime_error("writer"); };
    EXPECT_THROW(run_fed({"sleep", "1000"}, write), std::runtime_error);
}

TEST(FedCommand, KnowsWhatIsOnThePath) {
    EXPECT_TRUE(is_on_path("sh"));
    EXPECT_FALSE(is_on_path("no_such_program_of_this_name"));
}

}  // namespace
}  // namespace mray
