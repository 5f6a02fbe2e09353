// Calls of the system that fail, one in each run of the program: memory, files and threads. The
// program ends within seconds, with a documented exit code and one line that says why; files that
// are there are whole.
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <ostream>
#include <set>

#include "tests/app/program.h"
#include "tests/faults/fault_calls.h"

namespace mray::test {
namespace {

/// Runs a command in a folder of its own, which holds an OBJ scene and a file of rays.
class FaultyRun {
public:
    explicit FaultyRun(std::vector<std::string> arguments, const std::string& fault = {})
        : counts_(folder_.write("counts", std::string(sizeof(FaultCounts), '\0'))) {
        folder_.write("in/scene.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.5\nf 1 2 3\nf 2 4 3\n");
        folder_.write("in/rays", "0.2 0.2 5  0 0 -1\n0.9 0.9 5  0 0 -1\n5 5 5  0 0 -1\n");
        outcome =
            run(arguments, {.environment = {"LD_PRELOAD=" FAULT_LIBRARY, "MORPHRAY_FAULT=" + fault,
                                            "MORPHRAY_FAULT_COUNTS=" + counts_.native()},
                            .folder = folder_.path()});
    }

    FaultCounts counts() const {
        FaultCounts counts;
        const std::string bytes = read_file(counts_);
        std::copy_n(bytes.data(), sizeof counts, reinterpret_cast<char*>(&counts));
        return counts;
    }

    /// The outputs by their names.
    std::map<std::string, std::string> outputs() const {
        std::map<std::string, std::string> files;
        for (const std::string& name : folder_.names()) {
            if (name == "counts" || name.starts_with("in")) continue;
            const std::filesystem::path path = folder_.path() / name;
            if (std::filesystem::is_regular_file(path)) files[name] = read_file(path);
        }
        return files;
    }

    Outcome outcome;

private:
    const TemporaryFolder folder_;
    const std::filesystem::path counts_;
};

struct Work {
    const char* name;
    std::vector<std::string> arguments;
};

/// For the names of tests.
void PrintTo(const Work& work, std::ostream* out) { *out << work.name; }

std::vector<Work> works() {
    return {
        {"render",
         {"render", "in/scene.obj", "--backend", "cpu", "--threads", "2", "--size", "16x16",
          "--out", "out", "--json", "report.json", "--hits", "hits"}},
        {"crosscheck",
         {"crosscheck", "builtin:cloth:500", "--backend", "cpu", "--threads", "2", "--size",
          "16x16", "--frames", "0..1", "--json", "report.json", "--junit", "report.xml"}},
        {"profile",
         {"profile", "builtin:cloth:500", "--backend", "cpu", "--threads", "2", "--size", "16x16",
          "--frames", "0..1", "--repeat", "1", "--json", "report.json", "--csv", "frames.csv"}},
        {"trace", {"trace", "in/scene.obj", "--rays", "in/rays", "--out", "hits"}}};
}

/// Whether a file is as large as it should be: that of the run without a fault, or, with times in
/// it, a whole one of its kind.
void expect_whole(const std::string& name, const std::string& bytes, const std::string& expected) {
    if (name.ends_with(".json")) {
        EXPECT_TRUE(nlohmann::json::accept(bytes)) << name;
    } else if (name.ends_with(".xml")) {
        EXPECT_NE(bytes.find("</testsuite"), std::string::npos) << name;
    } else if (name.ends_with(".csv")) {
        EXPECT_EQ(std::count(bytes.begin(), bytes.end(), '\n'),
                  std::count(expected.begin(), expected.end(), '\n'))
            << name;
    } else {
        EXPECT_EQ(bytes, expected) << name;
    }
}

/// Runs the work with each `step`-th call of a kind failing.
void expect_handled(const Work& work, FaultKind kind, int error, const std::set<int>& codes,
                    std::uint64_t step = 1) {
    const FaultyRun whole(work.arguments);
    ASSERT_EQ(whole.outcome.code, 0) << whole.outcome.err;
    const std::map<std::string, std::string> expected = whole.outputs();
    const std::uint64_t calls = whole.counts().calls[kind];
    ASSERT_GT(whole.counts().calls[kAllocation], 0u) << "the preloaded library counts nothing";
    if (std::getenv("MORPHRAY_EVERY_FAULT") != nullptr) step = 1;
    for (std::uint64_t call = 0; call < calls; call += step) {
        const std::string fault = std::string(kFaultNames[kind]) + ":" + std::to_string(call) +
                                  ":" + std::to_string(error);
        SCOPED_TRACE(std::string(work.name) + " " + fault);
        const FaultyRun faulty(work.arguments, fault);
        const Outcome& outcome = faulty.outcome;
        EXPECT_EQ(codes.count(outcome.code), 1u) << outcome.code << ": " << outcome.err;
        if (outcome.code != 0) {
            EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
            EXPECT_TRUE(outcome.err.starts_with("morphray: ") ||
                        outcome.err.find(": ") != std::string::npos)
                << outcome.err;
        }
        const std::map<std::string, std::string> outputs = faulty.outputs();
        if (outcome.code == 0) {
            EXPECT_EQ(outputs.size(), expected.size());
        }
        for (const auto& [name, bytes] : outputs) {
            const auto known = expected.find(name);
            if (known == expected.end()) {
                ADD_FAILURE() << "an unexpected file: " << name;
                continue;
            }
            expect_whole(name, bytes, known->second);
        }
    }
}

class Faults : public ::testing::TestWithParam<Work> {};

INSTANTIATE_TEST_SUITE_P(All, Faults, ::testing::ValuesIn(works()),
                         [](const auto& work) { return std::string(work.param.name); });

// Constructors of libraries, before main, end the process by abort() if memory runs out.
TEST_P(Faults, OfMemory) { expect_handled(GetParam(), kAllocation, ENOMEM, {0, 6, 134}, 151); }

TEST_P(Faults, OfOpening) {
    for (const int error : {EMFILE, EIO, EACCES})
        expect_handled(GetParam(), kOpen, error, {0, 3, 5});
}

TEST_P(Faults, OfReading) { expect_handled(GetParam(), kRead, EIO, {0, 3}); }

TEST_P(Faults, OfWriting) {
    for (const int error : {ENOSPC, EIO}) expect_handled(GetParam(), kWrite, error, {5});
    // Interrupted, and short.
    for (const int error : {EINTR, 0}) expect_handled(GetParam(), kWrite, error, {0});
}

TEST_P(Faults, OfSynchronising) { expect_handled(GetParam(), kSync, EIO, {5}); }

TEST_P(Faults, OfRenaming) { expect_handled(GetParam(), kRename, EIO, {5}); }

TEST_P(Faults, OfLinking) { expect_handled(GetParam(), kLink, ENOSPC, {5}); }

TEST_P(Faults, OfThreads) { expect_handled(GetParam(), kThread, EAGAIN, {0, 6}); }

}  // namespace
}  // namespace mray::test
