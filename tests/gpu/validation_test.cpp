// Messages of the validation layer become errors: a planted mistake causes one, and a whole session
// causes none.
#include <gtest/gtest.h>

#include "common/update/restructure.h"
#include "gpu/shared_device.h"
#include "gpu/vulkan/context.h"
#include "tests/gpu/test_scenes.h"
#include "tests/shaders/hazard_spirv.h"
#include "tests/support/thrown_error.h"

namespace mray::test {
namespace {

const gpu::VulkanConfig kValidated = {.device = "", .validate = true};

/// Three words, and kernels that copy the first to the second and the second to the third.
class Chain {
public:
    Chain()
        : shared_(gpu::open_device(kValidated, gpu::Tuning{})),
          context_(shared_->device, 60'000),
          words_{word("first"), word("second"), word("third")},
          copies_{copy(0, 1), copy(1, 2)} {}

    void run(bool with_barrier) {
        context_.submit("copy twice", [&](VkCommandBuffer commands) {
            copies_[0].dispatch(commands, std::uint32_t{0}, 1);
            if (with_barrier) {
                // Writer: the first kernel; reader: the second.
                gpu::barrier(commands);
            }
            copies_[1].dispatch(commands, std::uint32_t{0}, 1);
        });
    }

private:
    gpu::Buffer word(const char* name) {
        return {shared_->device, name, 4, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, gpu::Memory::kDevice};
    }
    gpu::BoundPipeline copy(std::size_t from, std::size_t to) {
        gpu::Pipeline& compiled = shared_->pipelines.get(shared_->device, k_hazard_spirv, {});
        gpu::BoundPipeline pipeline(shared_->device, compiled);
        gpu::Bindings bindings;
        bindings.buffers[kBindHits] = words_[from].get();
        bindings.buffers[kBindOcclusion] = words_[to].get();
        pipeline.bind(bindings);
        return pipeline;
    }

    std::shared_ptr<gpu::SharedDevice> shared_;
    gpu::Context context_;
    gpu::Buffer words_[3];
    gpu::BoundPipeline copies_[2];
};

TEST(Validation, FindsAPlantedMissingBarrier) {
    Chain chain;
    EXPECT_NO_THROW(chain.run(true));
    const std::optional<Error> error = error_of([&] { chain.run(false); });
    ASSERT_TRUE(error.has_value());
    EXPECT_EQ(error->kind(), ErrorKind::kInternal);
    EXPECT_NE(std::string(error->what()).find("SYNC-HAZARD-READ-AFTER-WRITE"), std::string::npos)
        << error->what();
}

TEST(Validation, HasNothingToSayAboutCopiesOfSeveralPieces) {
    gpu::ValidationLog log;
    const std::shared_ptr<gpu::SharedDevice> shared =
        gpu::open_device(kValidated, {.force_staging = true, .log = &log});
    gpu::Context context(shared->device, 60'000);
    gpu::Transfer transfer(context);
    // More than two pieces, and no multiple of one.
    constexpr std::size_t kBytes = (std::size_t{2} << 20) / 3 * 2 * 16 + 12345 * 16;
    gpu::Buffer buffer(shared->device, "bytes", kBytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                       gpu::Memory::kDevice);
    ASSERT_TRUE(buffer.mapped().empty());
    std::vector<std::byte> bytes(kBytes);
    for (std::size_t i = 0; i < kBytes; ++i) bytes[i] = static_cast<std::byte>(i % 251);

    transfer.upload(bytes, buffer);
    std::vector<std::byte> read(kBytes);
    transfer.download(buffer, read);
    EXPECT_TRUE(read == bytes);
    EXPECT_TRUE(log.messages().empty()) << log.messages().front();
}

TEST(Validation, HasNothingToSayAboutAWholeSessionAndItsEnd) {
    gpu::ValidationLog log;
    for (const bool force_staging : {false, true}) {
        gpu::Tuning tuning = {.step_budget = 40, .force_staging = force_staging, .log = &log};
        if (force_staging) tuning.buffer_kind = gpu::BufferKind::kStorage;
        const std::unique_ptr<Backend> backend = gpu::make_vulkan_backend(kValidated, tuning);
        const TestScene scene = torus(24, 12);
        Bvh bvh = built_tree(scene);
        MovingScene moving(*backend, scene, bvh);
        moving.refit(swayed(scene, 1));
        moving.set_tree(scene.positions(), bvh);
        Frame frame;
        for (const std::uint32_t rays : {kRaysPrimary, kRaysShadow, kRaysAo})
            backend->trace_image(view(40, 30, rays), frame);
        for (const float time : {0.5f, 0.75f, 1.5f, 0.5f}) {
            moving.refit(swayed(scene, time));
            backend->trace_image(view(40, 30, kRaysShadow), frame);
        }
        BuiltAreas areas = built_areas(bvh);
        backend->edit_tree([&](Bvh& tree) {
            return restructure(scene.topology(), swayed(scene, 0.5f), 1, 1, tree, areas) > 0;
        });
        std::vector<Hit> hits(100);
        backend->trace({mixed_rays(scene, 100, 1), hits});
        backend->read_tree(bvh);
    }
    EXPECT_TRUE(log.messages().empty()) << log.messages().front();
}

}  // namespace
}  // namespace mray::test
