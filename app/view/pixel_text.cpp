#include "app/view/pixel_text.h"

#include <fmt/format.h>

#include <glm/geometric.hpp>

#include "common/text/number_text.h"

namespace mray::app {
namespace {

const char* name_of(BackendChoice backend) {
    if (backend == BackendChoice::kVulkan) return "vulkan";
    return backend == BackendChoice::kBrute ? "brute" : "cpu";
}

vec3 position_of(const TracedScene::PixelHit& hit) {
    const float u = hit.hit.u;
    const float v = hit.hit.v;
    return (1 - u - v) * hit.corners[0] + u * hit.corners[1] + v * hit.corners[2];
}

std::string hit_text(const TracedScene::PixelHit& hit) {
    if (!hit.hit) return "  miss\n";
    const auto number = [](const char* name, float x) {
        return fmt::format("  {:<4} {:<17} {:.9g}\n", name, hex_text(x), x);
    };
    std::string text =
        is_on_mesh(hit) ? fmt::format("  prim {}\n", hit.hit.prim_id) : std::string("  ground\n");
    text += number("t", hit.hit.t) + number("u", hit.hit.u) + number("v", hit.hit.v);
    if (!is_on_mesh(hit)) return text;
    const vec3 p = position_of(hit);
    return text + fmt::format("  at   {:.6g}, {:.6g}, {:.6g}\n", p.x, p.y, p.z);
}

}  // namespace

std::string pixel_text(const PixelProbe& probe) {
    std::string text = fmt::format("pixel {},{}, frame {}\n", probe.request.pixel.x,
                                   probe.request.pixel.y, probe.request.image.frame);
    for (std::size_t i = 0; i < probe.hits.size(); ++i) {
        text += fmt::format("{}\n", name_of(probe.request.image.backends[i]));
        text += hit_text(probe.hits[i]);
    }
    if (probe.hits.size() < 2) return text;
    const bool is_equal = probe.hits[0].hit == probe.hits[1].hit;
    return text + (is_equal ? "equal bit by bit\n" : "DIFFERENT\n");
}

std::string pixel_note(const PixelProbe& probe) {
    std::string note = fmt::format("pixel {},{}", probe.request.pixel.x, probe.request.pixel.y);
    for (std::size_t i = 0; i < probe.hits.size(); ++i) {
        const TracedScene::PixelHit& hit = probe.hits[i];
        note += fmt::format("\n{}: ", name_of(probe.request.image.backends[i]));
        if (!hit.hit) {
            note += "nothing";
        } else if (is_on_mesh(hit)) {
            note += fmt::format("triangle {}, t {:.6g}", hit.hit.prim_id, hit.hit.t);
        } else {
            note += fmt::format("ground, t {:.6g}", hit.hit.t);
        }
    }
    if (probe.hits.size() < 2) return note;
    return note + (probe.hits[0].hit == probe.hits[1].hit ? "\nequal bit by bit" : "\nDIFFERENT");
}

}  // namespace mray::app
