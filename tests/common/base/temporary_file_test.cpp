// Files that get their names when they are whole, and what killed processes leave.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "common/base/hash.h"
#include "common/base/output_file.h"
#include "common/base/temporary_file.h"
#include "tests/support/temporary_folder.h"

namespace mray::test {
namespace {

std::string name_on(const std::string& host, pid_t process, int number = 0) {
    const std::uint64_t hash = Hasher().add(std::span(host.data(), host.size())).digest();
    return fmt::format(".morphray-{:08x}-{}-{}.partial", static_cast<std::uint32_t>(hash), process,
                       number);
}

std::string this_host() {
    char name[256] = {};
    ::gethostname(name, sizeof name - 1);
    return name;
}

pid_t ended_process() {
    const pid_t child = ::fork();
    if (child == 0) ::_exit(0);
    ::waitpid(child, nullptr, 0);
    return child;
}

TEST(TemporaryFile, PassesByNamesThatExist) {
    TemporaryFolder folder;
    const std::string taken = name_on(this_host(), ::getpid());
    folder.write(taken, "other");
    TemporaryFile file(folder.path());
    EXPECT_EQ(file.rename_to(folder.file("target")), 0);
    EXPECT_EQ(folder.names(), (std::vector<std::string>{taken, "target"}));
}

TEST(StrayFiles, OfEndedProcessesOfThisHostAreRemovedBeforeOutputsAreWritten) {
    for (const bool of_folder : {true, false}) {
        TemporaryFolder folder;
        const pid_t ended = ended_process();
        const std::vector<std::string> kept = {
            name_on("another host", ended), name_on(this_host(), ::getpid()),
            name_on(this_host(), 0), name_on(this_host(), ended) + ".png", "image.partial"};
        for (const std::string& name : kept) folder.write(name, "x");
        folder.write(name_on(this_host(), ended), "x");
        folder.write(name_on(this_host(), ended, 7), "x");
        of_folder ? make_output_folder(folder.path()) : check_writable(folder.file("new"));
        EXPECT_EQ(folder.names().size(), kept.size());
        for (const std::string& name : kept)
            EXPECT_TRUE(std::ifstream(folder.file(name)).good()) << name;
    }
}

}  // namespace
}  // namespace mray::test
