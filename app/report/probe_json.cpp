#include "app/report/probe_report.h"

#include <fmt/format.h>

#include "app/report/json_parts.h"
#include "common/text/number_text.h"

namespace mray::app {
namespace {

/// Every bit as text, and a number to read.
Json exact_of(float x) { return {{"hex", hex_text(x)}, {"value", x}}; }

Json exact_of(vec3 p) { return {exact_of(p.x), exact_of(p.y), exact_of(p.z)}; }

Json exact_of(const Ray& ray) {
    return {{"org", exact_of(ray.org)},
            {"dir", exact_of(ray.dir)},
            {"tnear", exact_of(ray.tnear)},
            {"tfar", exact_of(ray.tfar)}};
}

Json exact_of(const Hit& hit) {
    if (hit.prim_id == kNoPrim) return nullptr;
    return {{"prim_id", hit.prim_id},
            {"t", exact_of(hit.t)},
            {"u", exact_of(hit.u)},
            {"v", exact_of(hit.v)}};
}

Json exact_of(const Candidate& c) {
    return {{"prim_id", c.prim_id},
            {"is_hit", c.is_hit},
            {"t", exact_of(c.t)},
            {"u", exact_of(c.u)},
            {"v", exact_of(c.v)},
            {"edge_u", exact_of(c.edge_u)},
            {"edge_v", exact_of(c.edge_v)},
            {"edge_w", exact_of(c.edge_w)},
            {"may_hit", c.may_hit},
            {"inside", c.inside},
            {"has_area", c.has_area},
            {"in_range", c.in_range},
            {"finite", c.finite},
            {"meets_box", c.meets_box},
            {"t_least", exact_of(c.t_least)}};
}

}  // namespace

std::string to_json(const ProbeReport& report) {
    Json json = head_of(report.head);
    json["frame"] = report.frame;
    json["pixel"] = {report.pixel.x, report.pixel.y};
    json["backend"] = report.backend;
    json["device"] = report.device;
    json["update"] = report.update;
    json["refit_on"] = report.refit_on;
    json["rays"] = report.rays;
    json["scene_exponent"] = report.exponent;
    json["ray"] = exact_of(report.ray);
    json["user_org"] = report.world_org;
    json["user_depth"] = report.world_depth;
    json["hit"] = exact_of(report.image);
    json["hit_alone"] = exact_of(report.alone);
    json["occlusion"] = report.occlusion;
    json["colour"] = fmt::format("{:08x}", report.colour);
    json["secondary"] = Json::array();
    for (const ProbeReport::Secondary& s : report.secondary) {
        json["secondary"].push_back({{"ray", exact_of(s.ray)}, {"hit", exact_of(s.hit)}});
    }
    json["bvh_hash"] = hash_text(report.bvh_hash);
    json["tree"] = of(report.tree);
    json["candidates"] = Json::array();
    for (const Candidate& c : report.candidates) json["candidates"].push_back(exact_of(c));
    return json_text(json);
}

}  // namespace mray::app
