// Each instruction set shades pixels as plain loops over the shared text do.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "common/bvh/builder/bvh_builder.h"
#include "common/interop/camera.h"
#include "common/interop/shading.h"
#include "common/scene/camera_setup.h"
#include "common/scene/vertex_normals.h"
#include "cpu/cpu_backend.h"
#include "cpu/image/lit_shader.h"
#include "cpu/image/pixel_shader.h"
#include "tests/support/test_scene.h"
#include "tests/support/texture_colours.h"

namespace mray {
namespace {

using namespace test;
using cpu::LitSamples;

class EveryTarget : public testing::TestWithParam<SimdTarget> {};

/// Hits that no tracer finds: neighbours share triangles in regions of any shape, and some
/// triangles have no normal.
TEST_P(EveryTarget, ShadesWhatNeighboursShareAndTrianglesWithoutANormal) {
    const TestScene scene = star(3, 7);
    Topology topology = scene.topology();
    const auto count = static_cast<std::uint32_t>(topology.triangles.size());
    Random random(9);
    for (Albedo& albedo : topology.albedo) albedo = static_cast<Albedo>(random.bits()) & 0xFFFFFFu;
    ViewSpec view;
    view.width = 64;
    view.height = 32;
    const ImageParams params =
        make_image_params(view, bounds_of(scene.world_positions()), scene.space());
    for (const bool with_degenerate : {false, true}) {
        if (with_degenerate) topology.triangles[5].y = topology.triangles[5].x;
        const cpu::ShadedMesh mesh{&topology, scene.positions()};
        Frame frame;
        frame.width = params.width;
        frame.height = params.height;
        frame.pixels.assign(std::size_t{params.width} * params.height, 99);
        frame.occlusion.assign(frame.pixels.size(), 77);
        for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
            const std::uint32_t prim =
                random.below(4) == 0 ? random.below(count) : 4 + random.below(2);
            frame.hits.push_back({static_cast<float>(random.real(0.1, 4)) * kSceneExtent, 0, 0,
                                  random.below(9) == 0 ? kNoPrim : prim});
        }
        const cpu::Tile tile{0, 0, params.width, params.height};
        cpu::PixelShader(GetParam()).shade_camera({params, mesh, tile, frame});
        for (std::uint32_t y = 0; y < params.height; ++y) {
            for (std::uint32_t x = 0; x < params.width; ++x) {
                const std::size_t i = std::size_t{y} * params.width + x;
                const Hit& hit = frame.hits[i];
                const Ray ray = camera_ray(params.camera, x, y);
                const std::uint32_t expected = hit.prim_id == kNoPrim
                                                   ? background(y, params.height)
                                                   : shade(params, ray, mesh.surface(ray, hit),
                                                           topology.albedo[hit.prim_id], 0);
                ASSERT_EQ(frame.pixels[i], expected) << x << ", " << y;
                ASSERT_EQ(frame.occlusion[i], 0u) << x << ", " << y;
            }
        }
    }
}

/// Colours of every albedo where a channel is about to round up, and of any intensities.
TEST_P(EveryTarget, RoundsColoursAsTheirText) {
    ImageParams params = {};
    params.width = params.height = cpu::kBlockSide;
    params.rays = kRaysShadow;
    Frame frame;
    frame.width = frame.height = params.width;
    frame.pixels.resize(cpu::kBlockRays);
    frame.occlusion.resize(cpu::kBlockRays);
    const cpu::ShadedMesh mesh{};
    const cpu::Tile tile{0, 0, params.width, params.height};
    const std::uint8_t occluded[cpu::kBlockRays] = {};
    const cpu::PixelShader shader(GetParam());
    Random random(5);
    for (std::uint32_t i = 0; i < 256 * 256; ++i) {
        const double step = (i / 256 + 0.5) / 255;
        const double channel = i % 256;
        cpu::LitPixels lit;
        for (std::uint32_t ray = 0; ray < cpu::kBlockRays; ++ray) {
            const double at_step = 255 * step * step / channel * (1 + random.real(-1, 1) * 0x1p-19);
            const bool is_near = at_step > kUnlitIntensity && at_step < 1 && ray % 4 == 0;
            lit.intensity[ray] =
                static_cast<float>(is_near ? at_step : random.real(kUnlitIntensity, 1));
            lit.albedo[ray] = (static_cast<Albedo>(random.bits()) & 0xFFFF00u) | i % 256;
        }
        shader.shade_shadows({params, mesh, tile, frame}, occluded, &lit);
        for (std::uint32_t ray = 0; ray < cpu::kBlockRays; ++ray) {
            const std::uint32_t pixel =
                ray % cpu::kBlockSide * cpu::kBlockSide + ray / cpu::kBlockSide;
            ASSERT_EQ(frame.pixels[pixel], colour_of(lit.intensity[ray], lit.albedo[ray]))
                << lit.intensity[ray] << ", " << lit.albedo[ray];
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Shading, EveryTarget, testing::ValuesIn(supported_simd_targets()),
                         [](const auto& target) { return std::string(target.param.name); });

/// The same image by plain loops over the shared text.
class PlainShader {
public:
    explicit PlainShader(const LitSamples& samples) : s_(samples) {}

    std::uint32_t pixel(std::uint32_t x, std::uint32_t y) const {
        std::uint32_t sums[3] = {};
        for (std::uint32_t k = 0; k < s_.view.side * s_.view.side; ++k) {
            const std::uint32_t colour =
                sample(x * s_.view.side + k % s_.view.side, y * s_.view.side + k / s_.view.side);
            if (s_.view.side == 1) return colour;
            for (std::uint32_t i = 0; i < 3; ++i) {
                const std::uint32_t channel = colour >> (8 * i) & 0xFF;
                sums[i] += channel * channel;
            }
        }
        std::uint32_t channels[3];
        for (std::uint32_t i = 0; i < 3; ++i) {
            const double mean = static_cast<double>(sums[i]) / (s_.view.side * s_.view.side);
            channels[i] = static_cast<std::uint32_t>(std::sqrt(mean) + 0.5);
        }
        return pack_rgb(channels[0], channels[1], channels[2]);
    }

    /// As LitShader::find_flat_shadows.
    std::vector<std::uint32_t> flat_shadows(std::uint32_t y) const {
        std::vector<std::uint32_t> xs;
        for (std::uint32_t x = 0; x < s_.view.params.width; ++x)
            if (s_.shadows[at(x, y)] != 0 && is_hit(x, y) && is_smooth_lit(x, y)) xs.push_back(x);
        return xs;
    }

private:
    bool is_smooth_lit(std::uint32_t x, std::uint32_t y) const {
        const Hit& hit = s_.hits[at(x, y)];
        const uvec3 t = s_.topology.triangles[hit.prim_id];
        const Surface flat = flat_surface(x, y);
        vec3 n[3];
        find_corner_normals(hit.prim_id, flat.normal, n);
        const Surface above = smooth_surface(flat, s_.positions[t.x], s_.positions[t.y],
                                             s_.positions[t.z], n[0], n[1], n[2], hit.u, hit.v);
        return above.point != flat.point &&
               dot3(above.normal, s_.view.params.light - flat.point) > 0;
    }
    std::size_t at(std::uint32_t x, std::uint32_t y) const {
        return std::size_t{y} * s_.view.params.width + x;
    }
    bool is_hit(std::uint32_t x, std::uint32_t y) const {
        return s_.hits[at(x, y)].prim_id != kNoPrim;
    }
    vec3 through(std::uint32_t x, std::uint32_t y) const {
        return camera_direction(s_.view.params.camera, x, y);
    }
    Surface flat_surface(std::uint32_t x, std::uint32_t y) const {
        const Hit& hit = s_.hits[at(x, y)];
        const uvec3 t = s_.topology.triangles[hit.prim_id];
        return surface_at(camera_ray(s_.view.params.camera, x, y), hit, s_.positions[t.x],
                          s_.positions[t.y], s_.positions[t.z]);
    }
    vec3 flat_normal(std::uint32_t x, std::uint32_t y) const { return flat_surface(x, y).normal; }
    float depth(std::uint32_t x, std::uint32_t y) const {
        return s_.hits[at(x, y)].t * camera_depth_scale(s_.view.params.camera, x, y);
    }

    float open_at(std::uint32_t x, std::uint32_t y) const {
        if (s_.view.ao_count == 0) return 1;
        const Camera& camera = s_.view.params.camera;
        const vec3 n = flat_normal(x, y);
        const float along = dot3(n, through(x, y));
        const float plane = along * depth(x, y);
        const float most = depth(x, y) * (4.0f * largest_component(camera.du));
        float occluded = 0;
        float count = 0;
        for (int dy = -1; dy <= 2; ++dy) {
            for (int dx = -1; dx <= 2; ++dx) {
                const std::uint32_t ox = x + static_cast<std::uint32_t>(dx);
                const std::uint32_t oy = y + static_cast<std::uint32_t>(dy);
                if (ox >= s_.view.params.width || oy >= s_.view.params.height || !is_hit(ox, oy))
                    continue;
                const float beside = (along + dot3(n, camera.dv) * static_cast<float>(dy)) +
                                     dot3(n, camera.du) * static_cast<float>(dx);
                const float apart = std::abs(beside * depth(ox, oy) - plane);
                if (dot3(n, flat_normal(ox, oy)) < 0.75f || apart > most) continue;
                occluded += static_cast<float>(s_.occlusion[at(ox, oy)]);
                count += 1;
            }
        }
        return openness(occluded, count * static_cast<float>(s_.view.ao_count));
    }

    void find_corner_normals(std::uint32_t prim, const vec3& flat, vec3 corners[3]) const {
        const uvec3 ids = s_.view.normals->ids()[prim];
        for (int k = 0; k < 3; ++k)
            corners[k] = ids[k] == kFlatCorner
                             ? flat
                             : corner_normal(s_.view.normals->normals()[ids[k]], flat);
    }

    vec3 normal(std::uint32_t x, std::uint32_t y) const {
        const vec3 flat = flat_normal(x, y);
        if (s_.view.normals == nullptr) return flat;
        const Hit& hit = s_.hits[at(x, y)];
        vec3 corners[3];
        find_corner_normals(hit.prim_id, flat, corners);
        return smooth_normal(corners[0], corners[1], corners[2], hit.u, hit.v);
    }

    vec3 base_colour(std::uint32_t x, std::uint32_t y, std::uint32_t albedo, const vec3& ray,
                     float depth) const {
        const vec3 base = albedo_colour(albedo);
        if ((albedo & kTexturedBit) == 0) return base;
        const Hit& hit = s_.hits[at(x, y)];
        const uvec3 t = s_.topology.triangles[hit.prim_id];
        const vec3 du = s_.view.params.camera.du;
        const double spacing = double{du.x} * du.x + double{du.y} * du.y + double{du.z} * du.z;
        const uvec3 colour =
            texture_colour(s_.textures, {hit.prim_id,
                                         hit.u,
                                         hit.v,
                                         {s_.positions[t.x], s_.positions[t.y], s_.positions[t.z]},
                                         ray,
                                         depth,
                                         spacing});
        return textured_colour(base, vec3(colour));
    }

    std::uint32_t sample(std::uint32_t x, std::uint32_t y) const {
        if (s_.view.kind == LitKind::kPlain) return s_.colours[at(x, y)];
        const float height = (static_cast<float>(y) + 0.5f) *
                             rcp_of_positive(static_cast<float>(s_.view.params.height));
        const float dithered = dithered_rounding(x / s_.view.side, y / s_.view.side);
        if (!is_hit(x, y))
            return s_.view.kind == LitKind::kLit ? encode_rgb(sky_colour(height), dithered)
                                                 : 0xFF000000u;
        const std::uint32_t prim = s_.hits[at(x, y)].prim_id;
        const vec3 ray = through(x, y);
        const float z = depth(x, y);
        if (s_.view.kind == LitKind::kDepth)
            return depth_colour(z, s_.view.near, s_.view.per_depth);
        if (s_.view.kind == LitKind::kPrim)
            return prim_colour(prim, dot3(flat_normal(x, y), unit(ray)));
        const vec3 n = normal(x, y);
        if (s_.view.kind == LitKind::kNormal) return normal_colour(n);
        const vec3 org = s_.view.params.camera.org;
        const vec3 point(org.x + z * ray.x, org.y + z * ray.y, org.z + z * ray.z);
        const float light = 1.0f - static_cast<float>(s_.shadows[at(x, y)]);
        const std::uint32_t albedo = s_.topology.albedo[prim];
        if ((albedo & kShadowCatcherBit) != 0)
            return encode_rgb(shadow_catcher_colour(height, light, open_at(x, y)), dithered);
        const vec3 base = base_colour(x, y, albedo, ray, z);
        return encode_rgb(lit_colour(n, unit(s_.view.params.light - point), light, open_at(x, y),
                                     s_.view.up, base));
    }

    const LitSamples& s_;
};

struct Size {
    std::uint32_t width, height;
};

/// Gives every second triangle one of two textures somewhere.
class TestTextures {
public:
    TestTextures(Topology& topology, Random& random) {
        for (const bool clamp : {false, true}) {
            std::vector<std::uint32_t> texels(13 * 8);
            for (std::uint32_t& texel : texels) texel = static_cast<std::uint32_t>(random.bits());
            textures_.push_back(std::make_shared<const cpu::Texture>(texels, 13, 8, clamp));
        }
        for (std::size_t i = 0; i < topology.triangles.size(); ++i) {
            const auto number = [&] { return static_cast<float>(random.real(-4, 4)); };
            Texcoords& texcoords = texcoords_.emplace_back();
            for (Texcoord& at : texcoords) at = {number(), number()};
            const std::uint32_t id = random.below(4);
            ids_.push_back(id < 2 ? id : kNoTexture);
            if (id < 2) topology.albedo[i] |= kTexturedBit;
        }
    }
    cpu::TexturedTriangles triangles() const { return {textures_, texcoords_, ids_}; }

private:
    std::vector<std::shared_ptr<const cpu::Texture>> textures_;
    std::vector<Texcoords> texcoords_;
    std::vector<std::uint32_t> ids_;
};

class EveryLitTarget : public testing::TestWithParam<SimdTarget> {
protected:
    EveryLitTarget() : shader_(GetParam()) {}

    void expect_same_images(const NamedScene& named, Size size, std::uint32_t side,
                            std::uint32_t ao_count) {
        const TestScene& scene = named.scene;
        Topology topology = scene.topology();
        Random random(7);
        for (Albedo& albedo : topology.albedo)
            albedo = static_cast<Albedo>(random.bits()) & 0x01FFFFFFu;
        const TestTextures textures(topology, random);
        std::vector<uvec3> ids = topology.triangles;
        for (std::size_t i = 0; i < ids.size(); i += 3) ids[i] = uvec3(kFlatCorner);
        VertexNormals normals(topology.triangles, ids);
        normals.update(scene.positions());

        ViewSpec view;
        view.width = size.width * side;
        view.height = size.height * side;
        view.ao_count = ao_count == 0 ? 1 : ao_count;
        ImageParams params =
            make_image_params(view, bounds_of(scene.world_positions()), scene.space());
        const auto backend = cpu::make_cpu_backend();
        backend->set_scene(topology, scene.pose(), build_bvh(topology, scene.positions()));
        Frame shadows;
        params.rays = kRaysShadow;
        backend->trace_image(params, shadows);
        Frame sky;
        params.rays = kRaysAo;
        if (ao_count > 0) backend->trace_image(params, sky);

        for (const LitKind kind :
             {LitKind::kPlain, LitKind::kLit, LitKind::kNormal, LitKind::kDepth, LitKind::kPrim}) {
            for (const bool is_flat : {false, true}) {
                SCOPED_TRACE(named.name + ", kind " + std::to_string(static_cast<int>(kind)) +
                             ", side " + std::to_string(side));
                const LitView lit_view{.params = params,
                                       .side = side,
                                       .kind = kind,
                                       .up = {0, 1, 0},
                                       .near = 3e5f,
                                       .per_depth = 1e-6f,
                                       .ao_count = ao_count,
                                       .normals = is_flat ? nullptr : &normals};
                const LitSamples samples{.view = lit_view,
                                         .topology = topology,
                                         .positions = scene.positions(),
                                         .textures = textures.triangles(),
                                         .hits = shadows.hits,
                                         .shadows = shadows.occlusion,
                                         .occlusion = sky.occlusion,
                                         .colours = shadows.pixels};
                const PlainShader plain(samples);
                std::vector<std::uint32_t> xs;
                for (std::uint32_t y = 0; !is_flat && y < params.height; ++y) {
                    shader_.find_flat_shadows(samples, y, xs);
                    ASSERT_EQ(xs, plain.flat_shadows(y)) << y;
                    flat_shadows_ += xs.size();
                }
                // In bands of several heights, with words after the last row that must stay.
                for (const std::uint32_t band : {size.height, 1u, 3u}) {
                    std::vector<std::uint32_t> pixels(size.width * size.height + 64, 77u);
                    for (std::uint32_t y = 0; y < size.height; y += band) {
                        shader_.shade_rows(samples, y, std::min(y + band, size.height),
                                           pixels.data() + std::size_t{y} * size.width, nullptr);
                    }
                    std::uint32_t differing = 0;
                    for (std::uint32_t i = 0; i < size.width * size.height; ++i)
                        differing += pixels[i] != plain.pixel(i % size.width, i / size.width);
                    EXPECT_EQ(differing, 0u);
                    EXPECT_EQ(std::count(pixels.end() - 64, pixels.end(), 77u), 64);
                }
            }
        }
    }

    cpu::LitShader shader_;
    std::size_t flat_shadows_ = 0;
};

TEST_P(EveryLitTarget, ShadesAsTheSharedTextOnEveryScene) {
    for (const NamedScene& named : adversarial_scenes()) {
        expect_same_images(named, {37, 11}, 1, 3);
        expect_same_images(named, {9, 10}, 2, 4);
    }
    const NamedScene small{"star", star(3, 7)};
    expect_same_images(small, {1, 1}, 8, 2);
    expect_same_images(small, {17, 9}, 4, 0);
    EXPECT_GT(flat_shadows_, 100u);
}

INSTANTIATE_TEST_SUITE_P(LitShading, EveryLitTarget, testing::ValuesIn(supported_simd_targets()),
                         [](const auto& target) { return std::string(target.param.name); });

TEST(LitColours, AreTheEndsOfTheirRanges) {
    EXPECT_EQ(normal_colour({1, 0, -1}), pack_rgb(255, 128, 0));
    EXPECT_EQ(depth_colour(2, 2, 0.5f), pack_rgb(255, 255, 255));
    EXPECT_EQ(depth_colour(2.5f, 2, 0.5f), encode_rgb({0.75f, 0.75f, 0.75f}));
    EXPECT_EQ(depth_colour(100, 2, 0.5f), pack_rgb(64, 64, 64));
    EXPECT_EQ(sky_colour(0), vec3(0.28125f, 0.3359375f, 0.421875f));
    EXPECT_EQ(sky_colour(1), vec3(0.75f, 0.75f, 0.734375f));
    // Nothing reaches a white surface that neither sees the sky nor the light.
    const vec3 up(0, 1, 0);
    const vec3 white = albedo_colour(0xFFFFFF);
    EXPECT_EQ(lit_colour(up, up, 0, 0, up, white), vec3(0, 0, 0));
    EXPECT_EQ(encode_rgb(lit_colour(up, up, 1, 1, up, white)), pack_rgb(255, 255, 255));
}

TEST(LitColours, SquaresOfTheBackgroundHaveSixteenTimesTheSteps) {
    for (int i = 0; i <= 4096; ++i) {
        const float c = 0.25f + static_cast<float>(i) / 8192;
        std::uint32_t sum = 0;
        for (std::uint32_t k = 0; k < 16; ++k)
            sum += encode_channel(c, dithered_rounding(20 + k % 4, 8 + k / 4));
        // The nearest whole number, but for the rounding of the root.
        EXPECT_NEAR(sum, 16 * 255 * std::sqrt(static_cast<double>(c)), 0.51) << i;
    }
}

TEST(LitColours, CreasesStayFlat) {
    const vec3 flat(0, 0, 1);
    EXPECT_EQ(corner_normal({0.6f, 0, 0.8f}, flat), vec3(0.6f, 0, 0.8f));
    EXPECT_EQ(corner_normal({0.61f, 0, 0.79f}, flat), flat);
    // The vertex normal of the other side.
    EXPECT_EQ(corner_normal({-0.6f, 0, -0.8f}, flat), vec3(0.6f, 0, 0.8f));
    EXPECT_EQ(corner_normal({0, 0, 0}, flat), flat);
}

TEST(LitColours, AreRoundedToTheNearestChannel) {
    EXPECT_EQ(encode_rgb({0, 0.25f, 1}), pack_rgb(0, 128, 255));
    for (int channel = 0; channel < 255; ++channel) {
        for (const double part : {0.45, 0.55}) {
            const double root = (channel + part) / 255;
            const auto c = static_cast<float>(root * root);
            const auto nearest = static_cast<std::uint32_t>(channel + (part > 0.5 ? 1 : 0));
            EXPECT_EQ(encode_rgb({c, c, c}), pack_rgb(nearest, nearest, nearest)) << root * 255;
        }
    }
}

TEST(LitColours, RootsOfMeansAreExact) {
    constexpr std::uint32_t kMost = 255 * 255 * 64;
    std::uint32_t root = 0;
    for (std::uint32_t sum = 0; sum <= kMost; ++sum) {
        // The middle between two whole numbers is the root of root^2 + root + 1/4.
        if (sum >= 64 * (root * root + root) + 16) ++root;
        ASSERT_EQ(root_of_mean(static_cast<float>(sum) / 64), root) << sum;
    }
    EXPECT_EQ(root, 255u);
}

}  // namespace
}  // namespace mray
