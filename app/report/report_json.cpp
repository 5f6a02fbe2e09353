#include "app/report/report_json.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/base/number_text.h"
#include "common/version.h"

namespace morphray::app {
namespace {

using Json = nlohmann::ordered_json;

Json head_of(const std::string& command) {
    return {{"schema", "morphray/1"}, {"command", command}, {"version", kVersion}};
}

Json head_of(const ReportHead& head) {
    Json json = head_of(head.command);
    json["scene"] = head.scene;
    json["triangles"] = head.triangles;
    json["vertices"] = head.vertices;
    if (head.width > 0) {
        json["width"] = head.width;
        json["height"] = head.height;
    }
    return json;
}

// Names may hold bytes that are not UTF-8; those become U+FFFD.
std::string text_of(const Json& json) {
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

void add_times(Json& json, const FrameTimes& times) {
    json["deform_ms"] = times.deform_ms;
    json["upload_ms"] = times.update.upload_ms;
    json["refit_ms"] = times.update.refit_ms;
    json["decide_ms"] = times.update.decide_ms;
    json["restructure_ms"] = times.update.restructure_ms;
    json["rebuild_ms"] = times.update.rebuild_ms;
    json["trace_ms"] = times.trace_ms;
}

Json of(const FrameReport& frame) {
    Json json = {{"frame", frame.frame},
                 {"backend", frame.backend},
                 {"update", frame.update},
                 {"refit_on", frame.refit_on},
                 {"hits_hash", hash_text(frame.hits_hash)},
                 {"image_hash", hash_text(frame.image_hash)},
                 {"bvh_hash", hash_text(frame.bvh_hash)}};
    add_times(json, frame.times);
    json["total_ms"] = frame.times.total_ms();
    json["rays"] = frame.times.rays;
    json["hits"] = frame.hits;
    json["misses"] = frame.misses;
    json["occluded"] = frame.occluded;
    json["sah_cost"] = frame.sah_cost;
    json["cost_ratio"] = frame.cost_ratio;
    json["reason"] = frame.reason;
    json["file"] = frame.file;
    return json;
}

Json of(const FrameDifference& difference) {
    return {{"total", difference.total()},
            {"false_miss", difference.false_miss},
            {"false_hit", difference.false_hit},
            {"prim_id", difference.prim_id},
            {"t", difference.t},
            {"uv", difference.uv},
            {"occlusion", difference.occlusion},
            {"colour", difference.colour}};
}

Json of(const CheckRow& row) {
    return {{"variant", row.variant()},
            {"backend", row.backend},
            {"simd", row.simd},
            {"update", row.update},
            {"refit_on", row.refit_on},
            {"frame", row.frame},
            {"rays", row.rays},
            {"reference", row.reference},
            {"equal", row.equal()},
            {"differences", of(row.difference)},
            {"expected_hits_hash", hash_text(row.expected_hits_hash)},
            {"hits_hash", hash_text(row.hits_hash)},
            {"expected_image_hash", hash_text(row.expected_image_hash)},
            {"image_hash", hash_text(row.image_hash)},
            {"trace_ms", row.trace_ms}};
}

Json of(const ProfileRow& row) {
    Json json = {{"frame", row.frame}, {"backend", row.backend}};
    add_times(json, row.times);
    json["total_ms"] = row.times.total_ms();
    json["trace_rebuilt_ms"] = row.trace_rebuilt_ms;
    json["rays"] = row.times.rays;
    json["sah_cost"] = row.sah_cost;
    json["rebuilt_sah_cost"] = row.rebuilt_sah_cost;
    return json;
}

Json of(const PolicyRun& run) {
    Json hashes = Json::array();
    for (const PolicyFrame& frame : run.frames) hashes.push_back(hash_text(frame.hits_hash));
    return {{"policy", run.policy},
            {"backend", run.backend},
            {"total_ms", run.total_ms()},
            {"median_frame_ms", run.median_frame_ms()},
            {"worst_frame_ms", run.worst_frame_ms()},
            {"worst_trace_vs_rebuilt", run.worst_trace_vs_rebuilt()},
            {"regret", run.regret()},
            {"rebuilds", run.rebuilds()},
            {"hits_hashes", hashes}};
}

Json of(const PolicyRun& run, const PolicyFrame& frame) {
    Json json = {{"policy", run.policy},
                 {"backend", run.backend},
                 {"frame", frame.frame},
                 {"update", frame.update},
                 {"reason", frame.reason}};
    add_times(json, frame.times);
    json["trace_rebuilt_ms"] = frame.trace_rebuilt_ms;
    json["cost_ratio"] = frame.cost_ratio;
    json["build_pending"] = frame.build_pending;
    json["rays"] = frame.times.rays;
    json["hits_hash"] = hash_text(frame.hits_hash);
    return json;
}

Json of(const BvhStats& stats) {
    return {{"sah_cost", stats.sah_cost},
            {"nodes", stats.node_count},
            {"leaves", stats.leaf_count},
            {"depth", stats.depth},
            {"children_per_node", stats.children_per_node},
            {"triangles_per_leaf", stats.triangles_per_leaf},
            {"vertices_per_leaf", stats.vertices_per_leaf},
            {"bytes", stats.bytes}};
}

// Every bit as text, and a number to read.
Json of(float x) { return {{"hex", fmt::format("{:a}", x)}, {"value", x}}; }

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
            {"t_enter", of(c.t_enter)}};
}

}  // namespace

std::string to_json(const RenderReport& report) {
    Json json = head_of(report.head);
    json["backend"] = report.backend;
    json["device"] = report.device;
    json["rays"] = report.rays;
    json["complete"] = report.complete;
    json["frames"] = Json::array();
    for (const FrameReport& frame : report.frames) json["frames"].push_back(of(frame));
    return text_of(json);
}

std::string to_json(const CheckReport& report) {
    Json json = head_of(report.head);
    json["device"] = report.device;
    json["complete"] = report.complete;
    json["equal"] = report.equal();
    json["rows"] = Json::array();
    for (const CheckRow& row : report.rows) json["rows"].push_back(of(row));
    json["trees"] = Json::array();
    for (const TreeRow& row : report.trees) {
        json["trees"].push_back({{"frame", row.frame},
                                 {"equal", row.equal()},
                                 {"cpu_bvh_hash", hash_text(row.cpu_hash)},
                                 {"vulkan_bvh_hash", hash_text(row.vulkan_hash)}});
    }
    return text_of(json);
}

std::string to_json(const ProfileReport& report) {
    Json json = head_of(report.head);
    json["rays"] = report.rays;
    json["repeat"] = report.repeat;
    json["complete"] = report.complete;
    json["frames"] = Json::array();
    for (const ProfileRow& row : report.rows) json["frames"].push_back(of(row));
    return text_of(json);
}

std::string to_json(const PolicyReport& report) {
    Json json = head_of(report.head);
    json["rays"] = report.rays;
    json["repeat"] = report.repeat;
    json["policies"] = Json::array();
    json["frames"] = Json::array();
    json["best_schedules"] = Json::array();
    for (const PolicyComparison& comparison : report.backends) {
        for (const PolicyRun& run : comparison.runs) {
            json["policies"].push_back(of(run));
            for (const PolicyFrame& frame : run.frames) json["frames"].push_back(of(run, frame));
        }
        Json rebuilt = Json::array();
        for (const std::size_t index : comparison.best.rebuilds)
            rebuilt.push_back(comparison.runs.front().frames[index].frame);
        json["best_schedules"].push_back({{"backend", comparison.runs.front().backend},
                                          {"total_ms", comparison.best.total},
                                          {"rebuilt_at", rebuilt}});
    }
    return text_of(json);
}

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
    json["user_org"] = report.user_org;
    json["user_depth"] = report.user_depth;
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
    return text_of(json);
}

std::string to_json(const SceneReport& report) {
    Json json = head_of(report.head);
    json["first_frame"] = report.first_frame;
    json["last_frame"] = report.last_frame;
    if (report.bounds.empty()) {
        json["bounds"] = nullptr;
    } else {
        json["bounds"] = {{"lower", report.bounds.lower}, {"upper", report.bounds.upper}};
    }
    json["scene_exponent"] = report.exponent;
    json["not_finite"] = report.degenerate.not_finite;
    json["zero_area"] = report.degenerate.zero_area;
    json["topology_hash"] = hash_text(report.topology_hash);
    json["trees"] = Json::array();
    for (const SceneReport::Tree& tree : report.trees) {
        Json row = {{"build", tree.build},
                    {"build_ms", tree.build_ms},
                    {"bvh_hash", hash_text(tree.bvh_hash)}};
        row.update(of(tree.stats));
        json["trees"].push_back(row);
    }
    return text_of(json);
}

std::string to_json(const ProgramReport& report) {
    Json json = head_of("info");
    json["build"] = report.build;
    json["builtins"] = Json::array();
    for (const ProgramReport::Builtin& builtin : report.builtins) {
        json["builtins"].push_back({{"name", builtin.name},
                                    {"description", builtin.description},
                                    {"default_triangles", builtin.default_triangles}});
    }
    json["backends"] = report.backends;
    return text_of(json);
}

std::string to_json(const std::vector<gpu::DeviceInfo>& devices) {
    Json json = head_of("devices");
    json["devices"] = Json::array();
    for (const gpu::DeviceInfo& device : devices) {
        json["devices"].push_back(
            {{"index", device.index},
             {"name", device.name},
             {"type", device.type},
             {"driver", device.driver},
             {"uuid", device.uuid},
             {"api", fmt::format("{}.{}", device.api_major, device.api_minor)},
             {"memory_bytes", device.memory_bytes},
             {"subgroup_size", device.subgroup_size},
             {"usable", device.unusable.empty()},
             {"unusable", device.unusable}});
    }
    return text_of(json);
}

}  // namespace morphray::app
