// Calls of the system that fail, one in each run of the program: memory, files and threads. The
// program ends within seconds, with a documented exit code and one line that says why; files that
// are there are whole.
#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <set>

#ifdef FAULT_LAYER_FOLDER
#include <vulkan/vulkan.h>
#endif

#include "tests/faults/fault_calls.h"
#include "tests/faults/works.h"

namespace mray::test {
namespace {

/// The thing that lets calls fail: the preloaded library, or the layer of Vulkan.
enum class Injector { kLibrary, kLayer };

/// Runs a command in a folder of its own, which holds an OBJ scene and a file of rays.
class FaultyRun {
public:
    explicit FaultyRun(const std::vector<std::string>& arguments, Injector injector,
                       const std::string& fault = {})
        : counts_(folder_.write("counts", std::string(sizeof(FaultCounts), '\0'))) {
        write_inputs(folder_);
        std::vector<std::string> environment = {"MORPHRAY_FAULT=" + fault,
                                                "MORPHRAY_FAULT_COUNTS=" + counts_.native()};
        if (injector == Injector::kLibrary) {
            environment.push_back("LD_PRELOAD=" FAULT_LIBRARY);
        } else {
            environment.push_back("VK_LAYER_PATH=" FAULT_LAYER_FOLDER);
            environment.push_back("VK_INSTANCE_LAYERS=VK_LAYER_MORPHRAY_faults");
            // A layer of Mesa's, which has calls of its own and ends with SIGSEGV if they fail.
            environment.push_back("NODEVICE_SELECT=1");
        }
        outcome = run(arguments, {.environment = environment, .folder = folder_.path()});
    }

    FaultCounts counts() const {
        FaultCounts counts;
        const std::string bytes = read_file(counts_);
        std::copy_n(bytes.data(), sizeof counts, reinterpret_cast<char*>(&counts));
        return counts;
    }

    Outputs outputs() const { return outputs_of(folder_); }

    Outcome outcome;

private:
    const TemporaryFolder folder_;
    const std::filesystem::path counts_;
};

/// Runs the work with each `step`-th call of a kind failing.
void expect_handled(const Work& work, FaultKind kind, int error, const std::set<int>& codes,
                    std::uint64_t step = 1) {
    const Injector injector = kind == kVulkan ? Injector::kLayer : Injector::kLibrary;
    const FaultyRun whole(work.arguments, injector);
    ASSERT_EQ(whole.outcome.code, 0) << whole.outcome.err;
    const Outputs expected = whole.outputs();
    const FaultCounts counts = whole.counts();
    const std::uint64_t calls = counts.calls[kind];
    ASSERT_GT(injector == Injector::kLayer ? calls : counts.calls[kAllocation], 0u)
        << "the library that lets calls fail counts nothing";
    if (std::getenv("MORPHRAY_EVERY_FAULT") != nullptr) step = 1;
    for (std::uint64_t call = 0; call < calls; call += step) {
        const std::string fault = std::string(kFaultNames[kind]) + ":" + std::to_string(call) +
                                  ":" + std::to_string(error);
        SCOPED_TRACE(std::string(work.name) + " " + fault);
        const FaultyRun faulty(work.arguments, injector, fault);
        const Outcome& outcome = faulty.outcome;
        EXPECT_EQ(codes.count(outcome.code), 1u) << outcome.code << ": " << outcome.err;
        if (outcome.code != 0) {
            EXPECT_EQ(lines(outcome.err).size(), 1u) << outcome.err;
            EXPECT_TRUE(outcome.err.starts_with("morphray: ") ||
                        outcome.err.find(": ") != std::string::npos)
                << outcome.err;
        }
        const Outputs outputs = faulty.outputs();
        if (outcome.code == 0) {
            EXPECT_EQ(outputs.size(), expected.size());
        }
        expect_whole(outputs, expected);
    }
}

class Faults : public ::testing::TestWithParam<Work> {};

INSTANTIATE_TEST_SUITE_P(All, Faults, ::testing::ValuesIn(works("cpu")),
                         [](const auto& work) { return std::string(work.param.name); });

// Constructors of libraries, before main, end the process by abort() if memory runs out.
TEST_P(Faults, OfMemory) { expect_handled(GetParam(), kAllocation, ENOMEM, {0, 6, 134}, 151); }

TEST_P(Faults, OfOpening) {
    for (const int error : {EMFILE, EIO, EACCES})
        expect_handled(GetParam(), kOpen, error, {0, 3, 5});
}

TEST_P(Faults, OfReading) {
    expect_handled(GetParam(), kRead, EIO, {0, 3});
    // Interrupted, and short.
    for (const int error : {EINTR, 0}) expect_handled(GetParam(), kRead, error, {0});
}

TEST_P(Faults, OfWriting) {
    for (const int error : {ENOSPC, EIO}) expect_handled(GetParam(), kWrite, error, {5});
    // Interrupted, and short.
    for (const int error : {EINTR, 0}) expect_handled(GetParam(), kWrite, error, {0});
}

TEST_P(Faults, OfSynchronising) { expect_handled(GetParam(), kSync, EIO, {5}); }

TEST_P(Faults, OfRenaming) { expect_handled(GetParam(), kRename, EIO, {5}); }

TEST_P(Faults, OfLinking) { expect_handled(GetParam(), kLink, ENOSPC, {5}); }

TEST_P(Faults, OfThreads) { expect_handled(GetParam(), kThread, EAGAIN, {0, 6}); }

class ChangedInputs : public ::testing::TestWithParam<Work> {};

INSTANTIATE_TEST_SUITE_P(All, ChangedInputs, ::testing::ValuesIn(input_works()),
                         [](const auto& work) { return std::string(work.param.name); });

// A file that another program changes between two reads is never taken for one that was whole. Of a
// sequence a file is read again for the next frame, and may be found damaged.
TEST_P(ChangedInputs, AreNoticed) {
    for (const FileChange change : {kShrinks, kGrows, kIsWritten})
        expect_handled(GetParam(), kInput, change, {3, 8});
}

#ifdef FAULT_LAYER_FOLDER
class VulkanFaults : public ::testing::TestWithParam<Work> {};

INSTANTIATE_TEST_SUITE_P(All, VulkanFaults, ::testing::ValuesIn(works("vulkan")),
                         [](const auto& work) { return std::string(work.param.name); });

TEST_P(VulkanFaults, OfMemory) {
    for (const int error : {VK_ERROR_OUT_OF_HOST_MEMORY, VK_ERROR_OUT_OF_DEVICE_MEMORY})
        expect_handled(GetParam(), kVulkan, error, {0, 4, 6}, 61);
}

TEST_P(VulkanFaults, OfALostDevice) {
    expect_handled(GetParam(), kVulkan, VK_ERROR_DEVICE_LOST, {0, 7}, 41);
}

#endif

}  // namespace
}  // namespace mray::test
