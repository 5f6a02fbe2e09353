#include "app/report/probe_report.h"

#include <fmt/format.h>

#include "app/report/json_parts.h"
#include "common/text/number_text.h"

namespace mray::app {
namespace {

/// Every bit as text, and a number to read.
Json of(float x) { return {{"hex", hex_text(x)}, {"value", x}}; }

Json of(vec3 p) { return {of(p.x), of(p.y), of(p.z)}; }

Json of(const Ray& ray) {
    return {{"org", of(ray.org)},
            {"dir", of(ray.dir)},
            {"tnear", of(ray.tnear)},
            {"tfar", of(ray.tfar)}};
}

Json of(const Hit& hit) {
    if (hit.prim_id == kNoPrim) return nullptr;
    return {{"prim_id", hit.prim_id}, {"t", of(hit.t)}, {"u", of(hit.u)}, {"v", of(hit.v)}};
}

Json of(const Candidate& c) {
    return {{"prim_id", c.prim_id},
            {"is_hit", c.is_hit},
            {"t", of(c.t)},
            {"u", of(c.u)},
            {"v", of(c.v)},
            {"edge_u", of(c.edge_u)},
            {"edge_v", of(c.edge_v)},
            {"edge_w", of(c.edge_w)},
            {"may_hit", c.may_hit},
            {"inside", c.inside},
            {"has_area", c.has_area},
            {"in_range", c.in_range},
            {"finite", c.finite},
            {"meets_box", c.meets_box},
            {"t_least", of(c.t_least)}};
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
    json["ray"] = of(report.ray);
    json["user_org"] = report.world_org;
    json["user_depth"] = report.world_depth;
    json["hit"] = of(report.image);
    json["hit_alone"] = of(report.alone);
    json["occlusion"] = report.occlusion;
    json["colour"] = fmt::format("{:08x}", report.colour);
    json["secondary"] = Json::array();
    for (const ProbeReport::Secondary& s : report.secondary) {
        json["secondary"].push_back({{"ray", of(s.ray)}, {"hit", of(s.hit)}});
    }
    json["bvh_hash"] = hash_text(report.bvh_hash);
    json["tree"] = of(report.tree);
    json["candidates"] = Json::array();
    for (const Candidate& c : report.candidates) json["candidates"].push_back(of(c));
    return json_text(json);
}

std::string to_json(const ReplayReport& report) {
    Json json = head_of("probe");
    json["scene"] = report.scene;
    json["frame"] = report.frame;
    json["expected"] = of(report.expected);
    json["answers"] = Json::array();
    for (const ReplayReport::Answer& answer : report.answers)
        json["answers"].push_back(
            {{"tracer", answer.tracer}, {"equal", answer.equal}, {"hit", of(answer.hit)}});
    return json_text(json);
}

}  // namespace mray::app
