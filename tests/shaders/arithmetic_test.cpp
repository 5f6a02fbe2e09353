// The shared functions give the same bits on the device and on the CPU. (Other tests compare them
// with oracles that share no code with them.)
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>

#include "gpu/shared_device.h"
#include "gpu/transfer.h"
#include "tests/shaders/cases.h"
#include "tests/shaders/evaluate_spirv.h"

namespace mray::test {
namespace {

constexpr std::uint32_t kBatch = 1u << 16;

/// Evaluates on the device.
class Evaluator {
public:
    explicit Evaluator(std::uint32_t function)
        : shared_(gpu::open_device({.device = "", .validate = true}, gpu::Tuning{})),
          context_(shared_->device, 60'000),
          transfer_(context_),
          inputs_(shared_->device, "inputs", sizeof(Inputs) * kBatch,
                  VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, gpu::Memory::kDevice),
          outputs_(shared_->device, "outputs", sizeof(Outputs) * kBatch,
                   VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, gpu::Memory::kDevice),
          pipeline_(shared_->device,
                    shared_->pipelines.get(shared_->device, k_evaluate_spirv, {function})) {
        gpu::Bindings bindings;
        bindings.buffers[kBindHits] = inputs_.get();
        bindings.buffers[kBindOcclusion] = outputs_.get();
        pipeline_.bind(bindings);
    }

    std::vector<Outputs> operator()(std::span<const Inputs> cases) {
        std::vector<Outputs> results(cases.size());
        for (std::size_t first = 0; first < cases.size(); first += kBatch) {
            const auto count =
                static_cast<std::uint32_t>(std::min<std::size_t>(kBatch, cases.size() - first));
            transfer_.upload(std::as_bytes(cases.subspan(first, count)), inputs_);
            context_.submit("evaluate", [&](VkCommandBuffer commands) {
                pipeline_.dispatch(commands, count, (count + kGroupSize - 1) / kGroupSize);
            });
            transfer_.download(outputs_,
                               std::as_writable_bytes(std::span(results).subspan(first, count)));
        }
        return results;
    }

private:
    std::shared_ptr<gpu::SharedDevice> shared_;
    gpu::Context context_;
    gpu::Transfer transfer_;
    gpu::Buffer inputs_;
    gpu::Buffer outputs_;
    gpu::BoundPipeline pipeline_;
};

bool same(const Outputs& a, const Outputs& b) { return std::memcmp(&a, &b, sizeof(Outputs)) == 0; }

/// The cases that the device answers differently.
std::vector<Inputs> differences(std::uint32_t function, std::size_t case_count) {
    const std::vector<Inputs> inputs = cases(function, case_count);
    const std::vector<Outputs> actual = Evaluator(function)(inputs);
    std::vector<Inputs> different;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        if (!same(evaluate(function, inputs[i]), actual[i])) different.push_back(inputs[i]);
    }
    return different;
}

/// The words in which the two sides differ.
std::string describe(std::uint32_t function, const Inputs& inputs) {
    const Outputs expected = evaluate(function, inputs);
    const Outputs actual = Evaluator(function)(std::span(&inputs, 1)).front();
    std::string text;
    for (std::uint32_t w = 0; w < kOutputWords; ++w) {
        if (expected.word[w] == actual.word[w]) continue;
        text += fmt::format("word {} is {:08x} on the CPU, {:08x} on the device; ", w,
                            expected.word[w], actual.word[w]);
    }
    return text;
}

class SharedFunction : public testing::TestWithParam<std::uint32_t> {};

TEST_P(SharedFunction, GivesTheSameBitsOnTheDevice) {
    const std::vector<Inputs> different = differences(GetParam(), 1'000'000);
    EXPECT_TRUE(different.empty())
        << different.size() << " cases, the first: " << describe(GetParam(), different.front());
}

INSTANTIATE_TEST_SUITE_P(Arithmetic, SharedFunction, testing::Range(0u, kEvalCount),
                         [](const auto& instance) {
                             return std::string(function_name(instance.param));
                         });

TEST(Cases, HitAndMissTriangles) {
    constexpr std::size_t kCount = 100'000;
    std::size_t hits = 0;
    for (const Inputs& i : cases(kEvalTriangle, kCount)) hits += evaluate(kEvalTriangle, i).word[0];
    EXPECT_GT(hits, kCount / 10);
    EXPECT_LT(hits, kCount * 9 / 10);
}

}  // namespace
}  // namespace mray::test
