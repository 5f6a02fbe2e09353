// The number that README.md has, and what it covers.
#include "library/src/digest.h"

#include <gtest/gtest.h>

#include <bitset>

#include "cpu/cpu_backend.h"
#include "library/src/device_impl.h"
#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Device;

TEST(Digest, IsTheDocumentedNumberOnAnyInstructionSetAndNumberOfThreads) {
    EXPECT_EQ(morphray::kDigest, 0x9FB61E2C84283B2Du);
    for (const std::string& simd : all_simd()) {
        for (const int threads : {1, 2}) {
            const Device device = Device::cpu({.threads = threads, .simd = simd});
            EXPECT_EQ(morphray::digest(device), morphray::kDigest) << device.description();
        }
    }
}

using SeenQueries = std::bitset<std::variant_size_v<QueryBatch>>;

/// Another backend that notes what is asked.
class Recorder : public Backend {
public:
    explicit Recorder(SeenQueries& seen,
                      std::unique_ptr<Backend> inner = cpu::make_scalar_backend())
        : Backend(inner->info()), seen_(seen), inner_(std::move(inner)) {}

    void set_scene(const Topology& topology, const Pose& pose, Bvh bvh) override {
        inner_->set_scene(topology, pose, std::move(bvh));
    }
    void set_tree(Bvh bvh) override { inner_->set_tree(std::move(bvh)); }
    std::uint64_t refit(RefitExtent extent) override { return inner_->refit(extent); }
    std::span<const Node> nodes() override { return inner_->nodes(); }
    const Bvh& host_tree() override { return inner_->host_tree(); }
    void read_tree(Bvh& bvh) override { inner_->read_tree(bvh); }
    void edit_tree(const TreeEdit& edit) override { inner_->edit_tree(edit); }
    void trace_image(const ImageParams& params, Frame& frame) override {
        inner_->trace_image(params, frame);
    }
    void trace_views(const ViewBatch& views) override { inner_->trace_views(views); }
    double trace(const RayBatch& batch) override { return inner_->trace(batch); }
    void query(const QueryBatch& batch) override {
        seen_.set(batch.index());
        inner_->query(batch);
    }
    const BackendTimes& finish() override { return inner_->finish(); }

private:
    SeenQueries& seen_;
    std::unique_ptr<Backend> inner_;
};

TEST(Digest, AsksEachKindOfQuery) {
    SeenQueries seen;
    const auto make = [&] { return std::make_unique<Recorder>(seen); };
    morphray::detail::compute_digest(morphray::detail::DeviceImpl::make(make, {.threads = 1}), 20);
    EXPECT_TRUE(seen.all()) << seen;
}

}  // namespace
}  // namespace mray::test
