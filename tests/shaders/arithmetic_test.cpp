// The shared functions give the same bits on the device and on the CPU. (Other tests compare them
// with oracles that share no code with them.)
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "gpu/shared_device.h"
#include "gpu/vulkan/context.h"
#include "tests/shaders/evaluate.h"
#include "tests/shaders/evaluate_spirv.h"
#include "tests/support/random.h"

namespace mray::test {
namespace {

// Random and extreme arguments for the shared functions, within the range of each function.

class Generator : public Random {
public:
    using Random::Random;

    float between(float low, float high) { return static_cast<float>(real(low, high)); }
    /// Any mantissa, either sign, exponent in [low, high].
    float scaled(int low, int high) {
        const auto x = static_cast<float>(std::ldexp(real(1, 2), from(low, high)));
        return one_in(2) ? -x : x;
    }

    /// A coordinate on the grid, sometimes an extreme one.
    float coordinate() {
        constexpr std::array kExtremes = {0.0f, kSceneExtent, -kSceneExtent, 0x1p-40f, 1.0f};
        if (one_in(3)) return pick(kExtremes);
        return snap_coordinate(one_in(11) ? scaled(-39, -10) : scaled(-10, 19));
    }
    vec3 coordinates() { return {coordinate(), coordinate(), coordinate()}; }
    vec3 point() { return one_in(64) ? vec3(kInvalidCoordinate) : coordinates(); }
    vec3 origin() {
        return one_in(8) ? vec3{scaled(20, 39), coordinate(), scaled(0, 39)} : coordinates();
    }
    vec3 direction() {
        vec3 d = {scaled(-30, 0), scaled(-4, 0), scaled(-4, 0)};
        if (one_in(8)) d.x = 0;
        if (one_in(8)) d.y = 0;
        if (one_in(32)) d = vec3(0);
        return canonical_direction(one_in(2) ? vec3(d.y, d.z, d.x) : d);
    }
    vec3 normal() { return unit(vec3(scaled(-4, 0), scaled(-4, 0), scaled(-4, 0))); }
};

/// A ray to a triangle, often to a vertex or an edge of it.
void set_ray_and_triangle(Inputs& i, Generator& g) {
    i.ray.org = g.origin();
    i.a = g.point();
    const float size = std::exp2(g.between(-30, 18));
    i.b = g.one_in(8) ? g.point() : snap_point(i.a + g.normal() * size);
    i.c = g.one_in(16) ? i.b : snap_point(i.a + g.normal() * size);
    const float s = g.one_in(3) ? 0.0f : g.between(0, 1);
    const float t = g.one_in(3) ? 0.0f : g.between(0, 1 - s);
    const vec3 aim = i.a + (i.b - i.a) * s + (i.c - i.a) * t;
    i.ray.dir = g.one_in(4) ? g.direction() : canonical_direction(aim - i.ray.org);
    i.ray.tnear = g.one_in(4) ? std::fabs(g.scaled(-10, 20)) : 0.0f;
    i.ray.tfar = g.one_in(4) ? std::fabs(g.scaled(-10, 21)) : kInfiniteT;
}

/// Around the triangle, anywhere, or empty.
void set_box(Inputs& i, Generator& g) {
    const auto side = [&] { return g.one_in(6) ? 0.0f : std::fabs(g.scaled(-20, 18)); };
    const bool is_near = i.a.x != kInvalidCoordinate && g.one_in(2);
    const vec3 lower = {side(), side(), side()};
    const vec3 upper = {side(), side(), side()};
    const vec3 p = is_near ? i.a : g.coordinates();
    i.box_lower = g.one_in(16) ? vec3(kEmptyPlane) : p - lower;
    i.box_upper = i.box_lower.x == kEmptyPlane ? vec3(-kEmptyPlane) : p + upper;
}

Inputs make_case(Generator& g) {
    Inputs i = {};
    set_ray_and_triangle(i, g);
    set_box(i, g);
    i.x = g.one_in(8) ? std::ldexp(1.0f, g.from(-100, 99)) : g.scaled(-100, 99);
    i.t = std::fabs(g.scaled(-10, 21));
    i.ao_tfar = std::fabs(g.scaled(-10, 21));
    i.point = g.coordinates();
    i.normal = g.normal();
    i.size = sum_of_abs(i.point) + std::fabs(g.scaled(-10, 21));
    i.rays = g.below(3);
    i.ao_count = 1 + g.below(256);
    i.occluded = g.below(i.ao_count + 1);
    i.mixed_sizes = {g.scaled(-60, 40), g.scaled(-60, 0), g.scaled(-60, -20)};
    if (g.one_in(4)) i.mixed_sizes.z = 0;
    i.albedo = g.below(0x1000000);
    i.light = g.coordinates();
    i.ao_index = g.below(256);
    i.camera.org = g.origin();
    const auto slope = [&](int low, int high) { return g.one_in(16) ? 0.0f : g.scaled(low, high); };
    i.camera.corner = {slope(-3, 3), slope(-3, 3), slope(-3, 3)};
    for (vec3* const step : {&i.camera.du, &i.camera.dv})
        *step = {slope(-20, -5), slope(-20, -5), slope(-20, -5)};
    i.pixel = {g.below(65536), g.below(65536), g.below(0xFFFFFFFF), 0};
    return i;
}

TEST(SharedFunctions, GiveTheSameBitsOnTheDevice) {
    constexpr std::uint32_t kBatch = 1u << 16;
    const auto shared = gpu::open_device({.device = "", .validate = true}, gpu::Tuning{});
    gpu::Context context(shared->device, 60'000);
    gpu::Transfer transfer(context);
    const auto buffer = [&](const char* name, std::size_t size) {
        return gpu::Buffer(shared->device, name, size * kBatch, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                           gpu::Memory::kDevice);
    };
    gpu::Buffer inputs = buffer("inputs", sizeof(Inputs));
    gpu::Buffer outputs = buffer("outputs", sizeof(Outputs));
    gpu::BoundPipeline pipeline(shared->device,
                                shared->pipelines.get(shared->device, k_evaluate_spirv, {}));
    gpu::Bindings bindings;
    bindings.buffers[kBindHits] = inputs.get();
    bindings.buffers[kBindOcclusion] = outputs.get();
    pipeline.bind(bindings);

    Generator generator(1);
    std::vector<Inputs> cases(kBatch);
    std::vector<Outputs> actual(kBatch);
    std::size_t hits = 0, count = 0;
    for (int batch = 0; batch < 16; ++batch) {
        for (Inputs& one : cases) one = make_case(generator);
        transfer.upload(std::as_bytes(std::span(cases)), inputs);
        context.submit("evaluate", [&](VkCommandBuffer commands) {
            pipeline.dispatch(commands, kBatch, kBatch / kGroupSize);
        });
        transfer.download(outputs, std::as_writable_bytes(std::span(actual)));
        for (std::size_t i = 0; i < cases.size(); ++i, ++count) {
            const Outputs expected = evaluate(cases[i]);
            hits += expected.word[kHitAnswer].w;
            for (std::uint32_t k = 0; k < kAnswers; ++k)
                ASSERT_EQ(actual[i].word[k], expected.word[k]) << "answer " << k << ", case " << i;
        }
    }
    EXPECT_GT(hits, count / 10);
    EXPECT_LT(hits, count * 9 / 10);
}

}  // namespace
}  // namespace mray::test
