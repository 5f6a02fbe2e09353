#include "app/farm/part.h"

#include <fmt/format.h>

#include "app/report/json_parts.h"
#include "common/text/number_text.h"

namespace mray::app {
namespace {

Json of(const PartImage& image) {
    Json json = {{"frame", image.frame},
                 {"file", image.file},
                 {"scene_hash", hash_text(image.scene_hash)},
                 {"hits_hash", hash_text(image.hits_hash)},
                 {"image_hash", hash_text(image.image_hash)},
                 {"outputs", Json::array()},
                 {"kept", image.is_kept},
                 {"host", image.host},
                 {"backend", image.backend},
                 {"device", image.device},
                 {"total_ms", image.total_ms}};
    for (const PartOutput& output : image.outputs)
        json["outputs"].push_back({{"file", output.file}, {"hash", hash_text(output.hash)}});
    return json;
}

Json of(const std::vector<PartImage>& images) {
    Json json = Json::array();
    for (const PartImage& image : images) json.push_back(of(image));
    return json;
}

}  // namespace

const char* name_of(PartState state) {
    switch (state) {
        case PartState::kRunning:
            return "running";
        case PartState::kDone:
            return "done";
        case PartState::kPartial:
            return "partial";
        case PartState::kInterrupted:
            return "interrupted";
        case PartState::kFailed:
            return "failed";
    }
    return "";
}

std::string part_name(const Shard& shard) {
    return fmt::format("part-{}-of-{}.json", shard.index, shard.count);
}

std::string check_folder_name(const Shard& shard) {
    return fmt::format("check-{}-of-{}", shard.index, shard.count);
}

std::string to_json(const Part& part) {
    const PartRender& render = part.render;
    Json json = head_of("render");
    json["part"] = part.shard.index;
    json["parts"] = part.shard.count;
    json["software"] = render.software;
    json["source"] = render.source;
    json["scene"] = render.scene;
    json["triangles"] = render.triangles;
    json["vertices"] = render.vertices;
    json["width"] = render.width;
    json["height"] = render.height;
    json["scene_hash"] = hash_text(render.scene_hash);
    json["verify_every"] = render.verify_every;
    json["all_frames"] = render.frames;
    json["state"] = name_of(part.state);
    json["exit_code"] = part.exit_code ? Json(*part.exit_code) : Json(nullptr);
    json["reason"] = part.reason;
    json["host"] = part.host;
    json["backend"] = part.backend;
    json["device"] = part.device;
    json["frames"] = of(part.images);
    json["checks"] = of(part.checks);
    json["frames_left"] = part.frames_left;
    json["checks_left"] = part.checks_left;
    return json_text(json);
}

}  // namespace mray::app
