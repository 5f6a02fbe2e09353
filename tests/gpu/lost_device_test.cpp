// Scenes of the library on a device that fails.
#include <gtest/gtest.h>

#include <vector>

#include "gpu/vulkan/vulkan_api.h"
#include "tests/library/scenes.h"

namespace mray::test {
namespace {

VKAPI_ATTR VkResult VKAPI_CALL lose_device(VkQueue, std::uint32_t, const VkSubmitInfo*, VkFence) {
    return VK_ERROR_DEVICE_LOST;
}
VKAPI_ATTR VkResult VKAPI_CALL lack_memory(VkDevice, const VkBufferCreateInfo*,
                                           const VkAllocationCallbacks*, VkBuffer*) {
    return VK_ERROR_OUT_OF_DEVICE_MEMORY;
}

/// Replaces a function of Vulkan while it lives.
template <class Function>
class Replacement {
public:
    Replacement(Function& function, Function by) : function_(function), before_(function) {
        function_ = by;
    }
    ~Replacement() { function_ = before_; }
    Replacement(const Replacement&) = delete;

private:
    Function& function_;
    Function before_;
};

class LostDevice : public testing::Test {
protected:
    morphray::Device device_ = morphray::Device::vulkan();
    UserMesh mesh_{icosphere(3)};
    std::vector<morphray::Ray> rays_ = world_rays(mesh_, 500, 41);

    morphray::Scene make_scene() const {
        return morphray::Scene::build(mesh_.view(), device_, {.update = morphray::Refit{}});
    }
};

TEST_F(LostDevice, IsReportedByEachCall) {
    morphray::Scene scene = make_scene();
    const std::vector<morphray::Hit> hits = hits_of(scene, rays_);
    {
        const Replacement fails(vkQueueSubmit, lose_device);
        EXPECT_EQ(error_of([&] { hits_of(scene, rays_); }), "device_lost");
        EXPECT_EQ(error_of([&] { scene.occluded(rays_[0]); }), "device_lost");
        EXPECT_EQ(error_of([&] { scene.render({.width = 8, .height = 8}); }), "device_lost");
        EXPECT_EQ(error_of([&] { make_scene(); }), "device_lost");
        for (morphray::Vec3& p : mesh_.points) p.x *= 0.5f;
        EXPECT_EQ(error_of([&] {
                      scene.update();
                      scene.last_update();
                  }),
                  "device_lost");
    }
    for (morphray::Vec3& p : mesh_.points) p.x *= 2;
    expect_same_hits(hits_of(make_scene(), rays_), hits);
}

TEST_F(LostDevice, AChangeWithoutMemoryLeavesOtherScenesAlone) {
    morphray::Scene scene = make_scene();
    const morphray::Scene other = make_scene();
    const std::vector<morphray::Hit> hits = hits_of(other, rays_);
    scene.attach(mesh_.view());
    {
        const Replacement fails(vkCreateBuffer, lack_memory);
        EXPECT_EQ(error_of([&] { scene.update(); }), "limit");
    }
    EXPECT_EQ(error_of([&] { scene.update(); }), "limit");
    EXPECT_EQ(error_of([&] { hits_of(scene, rays_); }), "limit");
    expect_same_hits(hits_of(other, rays_), hits);
}

}  // namespace
}  // namespace mray::test
