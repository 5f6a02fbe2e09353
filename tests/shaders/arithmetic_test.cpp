// The shared functions give the same bits on the device and on the CPU. (Other tests compare them
// with oracles that share no code with them.)
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
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
    vec3 point() {
        const vec3 p = {coordinate(), coordinate(), coordinate()};
        return one_in(64) ? vec3(kInvalidCoordinate) : p;
    }
    vec3 origin() {
        return one_in(8) ? vec3(scaled(20, 39), coordinate(), scaled(0, 39))
                         : vec3(coordinate(), coordinate(), coordinate());
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

/// Fills an Inputs from the front.
class Writer {
public:
    Writer& add(float x) { return add(floatBitsToUint(x)); }
    Writer& add(std::uint32_t x) {
        inputs_.word[at_++] = x;
        return *this;
    }
    Writer& add(vec3 v) { return add(v.x).add(v.y).add(v.z); }
    Inputs inputs() const { return inputs_; }

private:
    Inputs inputs_ = {};
    std::uint32_t at_ = 0;
};

/// A ray to a triangle, often to a vertex or an edge of it.
void add_ray_and_triangle(Writer& w, Generator& g) {
    const vec3 org = g.origin();
    const vec3 a = g.point();
    const float size = std::exp2(g.between(-30, 18));
    const vec3 b = g.one_in(8) ? g.point() : snap_point(a + g.normal() * size);
    const vec3 c = g.one_in(16) ? b : snap_point(a + g.normal() * size);
    const float s = g.one_in(3) ? 0.0f : g.between(0, 1);
    const float t = g.one_in(3) ? 0.0f : g.between(0, 1 - s);
    const vec3 aim = a + (b - a) * s + (c - a) * t;
    const vec3 dir = g.one_in(4) ? g.direction() : canonical_direction(aim - org);
    const float tnear = g.one_in(4) ? std::fabs(g.scaled(-10, 20)) : 0.0f;
    w.add(org).add(tnear).add(dir).add(g.one_in(4) ? std::fabs(g.scaled(-10, 21)) : kInfiniteT);
    w.add(a).add(b).add(c);
}

void add_surface(Writer& w, Generator& g) {
    const vec3 p = {g.coordinate(), g.coordinate(), g.coordinate()};
    w.add(p).add(g.normal()).add(sum_of_abs(p) + std::fabs(g.scaled(-10, 21)));
}

void add_camera(Writer& w, Generator& g) {
    w.add(g.origin());
    for (int i = 0; i < 9; ++i)
        w.add(g.one_in(16) ? 0.0f : g.scaled(i < 3 ? -3 : -20, i < 3 ? 3 : -5));
    w.add(g.below(65536)).add(g.below(65536));
}

void add_box(Writer& w, Generator& g) {
    const vec3 org = g.origin();
    const vec3 p = {g.coordinate(), g.coordinate(), g.coordinate()};
    const vec3 q = p + vec3(std::fabs(g.scaled(-20, 18)), std::fabs(g.scaled(-20, 18)),
                            g.one_in(4) ? 0.0f : std::fabs(g.scaled(-20, 18)));
    w.add(org).add(g.one_in(2) ? g.direction() : canonical_direction(p - org));
    if (g.one_in(16)) {
        w.add(vec3(kEmptyPlane)).add(vec3(-kEmptyPlane));
    } else {
        w.add(p).add(q);
    }
}

void add_shading(Writer& w, Generator& g) {
    const std::uint32_t ao_count = 1 + g.below(256);
    w.add(vec3(g.coordinate(), g.coordinate(), g.coordinate()));
    w.add(g.below(3)).add(ao_count);
    w.add(g.origin()).add(0.0f).add(g.direction()).add(kInfiniteT);
    add_surface(w, g);
    w.add(g.below(0x1000000)).add(g.below(ao_count + 1)).add(g.below(0xFFFFFFFF));
}

Inputs make_case(std::uint32_t function, Generator& g) {
    Writer w;
    switch (function) {
        case kEvalReciprocals:
            w.add(g.one_in(8) ? std::ldexp(1.0f, g.from(-100, 99)) : g.scaled(-100, 99));
            break;
        case kEvalProducts:
            w.add(g.point()).add(g.one_in(2) ? g.point() : g.normal());
            break;
        case kEvalSnap:
            w.add(g.scaled(-60, 40))
                .add(g.scaled(-60, 0))
                .add(g.one_in(4) ? 0.0f : g.scaled(-60, -20));
            break;
        case kEvalBox:
            add_box(w, g);
            break;
        case kEvalMayHit:
        case kEvalTriangle:
        case kEvalProject:
            add_ray_and_triangle(w, g);
            break;
        case kEvalCamera:
            add_camera(w, g);
            break;
        case kEvalSurface:
            add_ray_and_triangle(w, g);
            w.add(std::fabs(g.scaled(-10, 21)));
            break;
        case kEvalShadowRay:
            add_surface(w, g);
            w.add(vec3(g.coordinate(), g.coordinate(), g.coordinate()));
            break;
        case kEvalAoRay:
            add_surface(w, g);
            w.add(g.below(65536))
                .add(g.below(65536))
                .add(g.below(256))
                .add(std::fabs(g.scaled(-10, 21)));
            break;
        default:
            add_shading(w, g);
            break;
    }
    return w.inputs();
}

std::vector<Inputs> cases(std::uint32_t function, std::size_t count) {
    Generator generator(function + 1);
    std::vector<Inputs> result;
    result.reserve(count);
    for (std::size_t i = 0; i < count; ++i) result.push_back(make_case(function, generator));
    return result;
}

constexpr const char* kNames[] = {
    "Reciprocals", "Products",  "Snapping", "BoxTest",   "TriangleFilter", "HitRule",
    "Projection",  "CameraRay", "Surface",  "ShadowRay", "AoRay",          "Shading",
};
static_assert(std::size(kNames) == kEvalCount);

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
    const std::vector<Inputs> inputs = cases(GetParam(), 1'000'000);
    const std::vector<Outputs> actual = Evaluator(GetParam())(inputs);
    std::vector<Inputs> different;
    std::size_t hits = 0;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const Outputs expected = evaluate(GetParam(), inputs[i]);
        hits += expected.word[0];
        if (std::memcmp(&expected, &actual[i], sizeof(Outputs)) != 0)
            different.push_back(inputs[i]);
    }
    EXPECT_TRUE(different.empty())
        << different.size() << " cases, the first: " << describe(GetParam(), different.front());
    if (GetParam() != kEvalTriangle) return;
    EXPECT_GT(hits, inputs.size() / 10);
    EXPECT_LT(hits, inputs.size() * 9 / 10);
}

INSTANTIATE_TEST_SUITE_P(Arithmetic, SharedFunction, testing::Range(0u, kEvalCount),
                         [](const auto& instance) { return std::string(kNames[instance.param]); });

}  // namespace
}  // namespace mray::test
