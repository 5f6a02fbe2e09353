#include "gpu/ray_query/ray_query.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <memory>
#include <string>
#include <vector>

#include "common/base/stopwatch.h"
#include "common/interop/constants.h"
#include "gpu/kernel.h"
#include "gpu/ray_query/acceleration_structure.h"
#include "shaders/ray_query/candidates_spirv.h"
#include "shaders/ray_query/nearest_spirv.h"
#include "shaders/ray_query/occluded_spirv.h"

namespace mray::gpu {
namespace {

static_assert(kNoSuchPrim == kForeignPrim);

/// The extensions and features of ray queries.
DeviceExtras ray_query_extras() {
    static constexpr const char* kExtensions[] = {VK_KHR_RAY_QUERY_EXTENSION_NAME,
                                                  VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME,
                                                  VK_KHR_DEFERRED_HOST_OPERATIONS_EXTENSION_NAME};
    static VkPhysicalDeviceBufferDeviceAddressFeatures addresses = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES,
        .bufferDeviceAddress = VK_TRUE,
    };
    static VkPhysicalDeviceAccelerationStructureFeaturesKHR structures = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ACCELERATION_STRUCTURE_FEATURES_KHR,
        .pNext = &addresses,
        .accelerationStructure = VK_TRUE,
    };
    static const VkPhysicalDeviceRayQueryFeaturesKHR queries = {
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_RAY_QUERY_FEATURES_KHR,
        .pNext = &structures,
        .rayQuery = VK_TRUE,
    };
    return {"ray-query", kExtensions, &queries};
}

/// Rays of one dispatch.
constexpr std::size_t kMostRays = std::size_t{1} << 18;
/// Hits that the memory of one dispatch holds.
constexpr std::size_t kMostHits = std::size_t{1} << 20;

class RayQuery final : public DriverRays {
public:
    explicit RayQuery(const VulkanConfig& config)
        : context_(config, Tuning{}, ray_query_extras()),
          transfer_(context_),
          description_(fmt::format("{}, {}, Vulkan {}.{}", context_.physical().info.name,
                                   context_.physical().info.driver,
                                   context_.physical().info.api_major,
                                   context_.physical().info.api_minor)),
          nearest_("nearest", k_nearest_spirv, {}, RayQueryArguments{}),
          occluded_("occluded", k_occluded_spirv, {}, RayQueryArguments{}),
          candidates_("candidates", k_candidates_spirv, {}, RayQueryArguments{}),
          rays_(storage("rays", sizeof(Ray) * kMostRays)),
          hits_(storage("hits", sizeof(Hit) * kMostHits)),
          counts_(storage("counts", sizeof(std::uint32_t) * kMostRays)) {}

    const std::string& description() const override { return description_; }
    const DriverTimes& times() const override { return times_; }

    void set_scene(const Topology& topology, std::span<const vec3> positions) override {
        const Stopwatch watch;
        mesh_.reset();
        mesh_ = std::make_unique<StructuredMesh>(context_, transfer_, topology);
        mesh_->upload(transfer_, positions);
        times_.upload_ms = watch.ms();
        keep_validity(positions);
        times_.build_ms = mesh_->build(context_, false);
        bindings_.structure = mesh_->top();
        for (Kernel* const kernel : {&nearest_, &occluded_, &candidates_}) kernel->bind(bindings_);
    }

    bool update(std::span<const vec3> positions) override {
        const bool is_update = !keep_validity(positions);
        move_to(positions, is_update);
        return is_update;
    }

    void rebuild(std::span<const vec3> positions) override {
        keep_validity(positions);
        move_to(positions, false);
    }

    void intersect(std::span<const Ray> rays, std::span<Hit> hits) override {
        assert(rays.size() == hits.size());
        trace("trace rays", nearest_, rays, kMostRays, 0, [&](std::size_t first, std::size_t size) {
            transfer_.download(hits_, std::as_writable_bytes(hits.subspan(first, size)));
        });
    }

    void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded) override {
        assert(rays.size() == occluded.size());
        std::vector<std::uint32_t> answers;
        trace("trace rays", occluded_, rays, kMostRays, 0,
              [&](std::size_t first, std::size_t size) {
                  answers.resize(size);
                  transfer_.download(counts_, std::as_writable_bytes(std::span(answers)));
                  for (std::size_t i = 0; i < size; ++i)
                      occluded[first + i] = static_cast<std::uint8_t>(answers[i] != 0);
              });
    }

    void list(std::span<const Ray> rays, std::uint32_t most, HitLists& lists) override {
        assert(most >= 1 && most <= kMostHits);
        std::vector<std::uint32_t> counts;
        std::vector<Hit> hits;
        trace("list hits", candidates_, rays, std::min(kMostRays, kMostHits / most), most,
              [&](std::size_t, std::size_t size) {
                  counts.resize(size);
                  hits.resize(size * most);
                  transfer_.download(counts_, std::as_writable_bytes(std::span(counts)));
                  transfer_.download(hits_, std::as_writable_bytes(std::span(hits)));
                  for (std::size_t i = 0; i < size; ++i)
                      append(std::span(hits).subspan(i * most, most), counts[i], lists);
              });
    }

private:
    Buffer storage(const char* name, std::size_t bytes) {
        return {context_, name, bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, Memory::kDevice};
    }

    void move_to(std::span<const vec3> positions, bool is_update) {
        const Stopwatch watch;
        mesh_->upload(transfer_, positions);
        times_.upload_ms = watch.ms();
        times_.build_ms = mesh_->build(context_, is_update);
    }

    /// Remembers which vertices are valid. Returns whether that changed.
    bool keep_validity(std::span<const vec3> positions) {
        std::vector<bool> valid(positions.size());
        for (std::size_t i = 0; i < positions.size(); ++i)
            valid[i] = positions[i] != vec3(kInvalidCoordinate);
        const bool is_changed = valid != valid_;
        valid_ = std::move(valid);
        return is_changed;
    }

    static void append(std::span<const Hit> hits, std::uint32_t count, HitLists& lists) {
        const std::size_t listed = std::min<std::size_t>(hits.size(), count);
        lists.hits.insert(lists.hits.end(), hits.begin(),
                          hits.begin() + static_cast<std::ptrdiff_t>(listed));
        std::sort(lists.hits.end() - static_cast<std::ptrdiff_t>(listed), lists.hits.end(),
                  [](const Hit& a, const Hit& b) {
                      return a.t != b.t ? a.t < b.t : a.prim_id < b.prim_id;
                  });
        lists.listed.push_back(static_cast<std::uint32_t>(listed));
        lists.total.push_back(count);
    }

    /// Compiles a kernel before it is first timed.
    void prepare(Kernel& kernel) {
        if (kernel.is_compiled()) return;
        kernel.compile(context_);
        bindings_.buffers[kBindStoredRays] = rays_.get();
        bindings_.buffers[kBindHits] = hits_.get();
        bindings_.buffers[kBindOcclusion] = bindings_.buffers[kBindHitCounts] = counts_.get();
        kernel.bind(bindings_);
        context_.submit("compile a kernel",
                        [&](VkCommandBuffer commands) { kernel.dispatch_nothing(commands); });
    }

    /// Traces batches of at most `batch` rays; `take(first, size)` reads the answers of one.
    template <class Take>
    void trace(const char* what, Kernel& kernel, std::span<const Ray> rays, std::size_t batch,
               std::uint32_t most, Take take) {
        prepare(kernel);
        times_.trace_ms = 0;
        for (std::size_t first = 0; first < rays.size(); first += batch) {
            const std::size_t size = std::min(batch, rays.size() - first);
            transfer_.upload(std::as_bytes(rays.subspan(first, size)), rays_);
            const RayQueryArguments arguments = {.ray_count = static_cast<std::uint32_t>(size),
                                                 .most = most};
            times_.trace_ms += context_.submit(what, [&](VkCommandBuffer commands) {
                kernel.dispatch(commands, arguments,
                                (arguments.ray_count + kGroupSize - 1) / kGroupSize);
            });
            take(first, size);
        }
    }

    Context context_;
    Transfer transfer_;
    std::string description_;
    Kernel nearest_;
    Kernel occluded_;
    Kernel candidates_;
    Buffer rays_;
    Buffer hits_;
    Buffer counts_;
    Bindings bindings_;
    std::unique_ptr<StructuredMesh> mesh_;
    std::vector<bool> valid_;
    DriverTimes times_;
};

}  // namespace

std::unique_ptr<DriverRays> make_ray_query(const VulkanConfig& config) {
    return std::make_unique<RayQuery>(config);
}

}  // namespace mray::gpu
