#include <array>
#include <cmath>
#include <numbers>

#include "lab/accuracy/charts/charts.h"

namespace mray::accuracy {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

class Builder {
public:
    std::uint32_t vertex(double x, double y, double z) {
        scene_.positions.emplace_back(static_cast<float>(x), static_cast<float>(y),
                                      static_cast<float>(z));
        return static_cast<std::uint32_t>(scene_.positions.size() - 1);
    }
    void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        scene_.topology.triangles.push_back({a, b, c});
    }
    void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
        triangle(a, b, c);
        triangle(a, c, d);
    }
    ChartInput finish(std::string name) {
        scene_.name = std::move(name);
        scene_.topology.vertex_count = static_cast<std::uint32_t>(scene_.positions.size());
        scene_.topology.albedo.assign(scene_.topology.triangles.size(), kDefaultAlbedo);
        return std::move(scene_);
    }

private:
    ChartInput scene_;
};

/// A sphere of rings and sectors, closed, with two fans at its poles.
Builder sphere(double radius, const std::array<double, 3>& centre) {
    constexpr std::uint32_t kRings = 24;
    constexpr std::uint32_t kSectors = 32;
    Builder build;
    const auto at = [&](double polar, double around) {
        return build.vertex(centre[0] + radius * std::sin(polar) * std::cos(around),
                            centre[1] + radius * std::cos(polar),
                            centre[2] + radius * std::sin(polar) * std::sin(around));
    };
    const std::uint32_t top = at(0, 0);
    for (std::uint32_t i = 1; i < kRings; ++i) {
        for (std::uint32_t j = 0; j < kSectors; ++j)
            at(std::numbers::pi * i / kRings, kTurn * j / kSectors);
    }
    const std::uint32_t bottom = at(std::numbers::pi, 0);
    const auto id = [&](std::uint32_t ring, std::uint32_t sector) {
        return 1 + (ring - 1) * kSectors + sector % kSectors;
    };
    for (std::uint32_t j = 0; j < kSectors; ++j) {
        build.triangle(top, id(1, j), id(1, j + 1));
        for (std::uint32_t i = 1; i + 1 < kRings; ++i)
            build.quad(id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1));
        build.triangle(bottom, id(kRings - 1, j + 1), id(kRings - 1, j));
    }
    return build;
}

ChartInput needles() {
    Builder build;
    Random random(1);
    for (int i = 0; i < 400; ++i) {
        std::array<double, 3> base;
        for (double& x : base) x = random.real(-1, 1);
        // The tips point to the default camera.
        const double way = random.real(0.3, 0.6);
        const std::uint32_t a = build.vertex(base[0], base[1], base[2]);
        const std::uint32_t b = build.vertex(base[0] + 1e-4, base[1] + 1e-4, base[2]);
        const std::uint32_t c =
            build.vertex(base[0] + way * (2 - base[0]), base[1] + way * (2 - base[1]),
                         base[2] + way * (5 - base[2]));
        build.triangle(a, b, c);
    }
    return build.finish("needles");
}

/// Thin triangles around one vertex that all rays at it must hit.
ChartInput fan() {
    constexpr std::uint32_t kBlades = 2000;
    Builder build;
    const std::uint32_t middle = build.vertex(0.1, 0.2, 0.3);
    for (std::uint32_t i = 0; i < kBlades; ++i) {
        const double angle = kTurn * i / kBlades;
        build.vertex(std::cos(angle), std::sin(angle), 0.2 * std::sin(5 * angle));
    }
    for (std::uint32_t i = 0; i < kBlades; ++i)
        build.triangle(middle, 1 + i, 1 + (i + 1) % kBlades);
    return build.finish("fan");
}

/// A wavy sheet `copies` times in the same place, every second one turned around.
ChartInput sheets(const std::string& name, std::uint32_t copies, double apart) {
    constexpr std::uint32_t kCells = 24;
    Builder build;
    for (std::uint32_t copy = 0; copy < copies; ++copy) {
        const auto first = copy * (kCells + 1) * (kCells + 1);
        for (std::uint32_t i = 0; i <= kCells; ++i) {
            for (std::uint32_t j = 0; j <= kCells; ++j) {
                const double x = 2.0 * i / kCells - 1;
                const double y = 2.0 * j / kCells - 1;
                build.vertex(x, y, 0.2 * std::sin(3 * x + 2 * y) + apart * copy);
            }
        }
        const auto at = [&](std::uint32_t i, std::uint32_t j) {
            return first + i * (kCells + 1) + j;
        };
        for (std::uint32_t i = 0; i < kCells; ++i) {
            for (std::uint32_t j = 0; j < kCells; ++j) {
                if (copy % 2 == 0) {
                    build.quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                } else {
                    build.quad(at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
                }
            }
        }
    }
    return build.finish(name);
}

ChartInput detail() {
    Builder build = sphere(1, {1000, 1, 1000});
    const std::uint32_t a = build.vertex(-5e5, 0, -5e5);
    const std::uint32_t b = build.vertex(5e5, 0, -5e5);
    const std::uint32_t c = build.vertex(5e5, 0, 5e5);
    const std::uint32_t d = build.vertex(-5e5, 0, 5e5);
    build.quad(a, b, c, d);
    return build.finish("detail 1 in 1e6");
}

}  // namespace

std::vector<ChartInput> failure_scenes() {
    std::vector<ChartInput> scenes;
    scenes.push_back(sphere(1, {0, 0, 0}).finish("sphere"));
    scenes.push_back(sphere(1, {1e3, 1e3, 1e3}).finish("offset 1e3"));
    scenes.push_back(sphere(1, {1e5, 1e5, 1e5}).finish("offset 1e5"));
    scenes.push_back(sphere(1e-20, {0, 0, 0}).finish("scale 1e-20"));
    scenes.push_back(sphere(1e30, {0, 0, 0}).finish("scale 1e30"));
    scenes.push_back(needles());
    scenes.push_back(fan());
    scenes.push_back(sheets("duplicates", 4, 0));
    scenes.push_back(sheets("nearly coplanar", 4, 1e-6));
    scenes.push_back(detail());
    return scenes;
}

}  // namespace mray::accuracy
