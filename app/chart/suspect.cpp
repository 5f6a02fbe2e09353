#include "app/chart/suspect.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <tuple>

#include "accuracy/suspect/aimed_rays.h"
#include "accuracy/suspect/joined_meshes.h"
#include "accuracy/suspect/reproducer.h"
#include "app/backends/backends.h"
#include "app/base/library_calls.h"
#include "app/base/memory_budget.h"
#include "app/chart/suspect_report.h"
#include "app/clip/frames.h"
#include "app/terminal/interrupt.h"
#include "app/terminal/progress.h"
#include "common/base/errors.h"
#include "common/base/hash.h"
#include "common/base/output_file.h"
#include "common/bvh/builder/bvh_builder.h"
#include "common/image/png.h"
#include "common/scene/camera_setup.h"
#include "common/text/message_text.h"
#include "morphray/hits.hpp"
#include "tools/process/shell_text.h"

namespace mray::app {
namespace {

using namespace accuracy;

constexpr std::uint32_t kDefaultSide = 256;
constexpr std::size_t kAimedRays = 20'000;
/// Findings of a kind that the reports describe.
constexpr std::size_t kDescribed = 3;
constexpr std::size_t kPictures = 8;
/// Scenes of this name are the meshes of suspect_scenes().
constexpr const char* kFailures = "failures:";

/// A scene with its poses in scene space.
struct Suspected {
    std::string name;
    Topology topology;
    ImageParams params;
    struct Pose {
        double frame;
        std::vector<vec3> positions;
    };
    std::vector<Pose> poses;
    /// Whether `morphray probe` knows the scene.
    bool is_clip = false;
};

Suspected open_clip_scene(const Options& options, const std::string& scene,
                          const Messages& messages) {
    Options one = options;
    one.scene = scene;
    SceneFrames frames = open_frames(one, messages);
    const Clip& clip = frames.clip();
    const std::vector<double> chosen = select_frames(one, clip, DefaultFrames::kFew);
    warn_of_damage(one, clip, chosen, messages);
    require_memory({.triangles = clip.topology().triangles.size(),
                    .vertices = clip.topology().vertex_count,
                    .copies = 4 + chosen.size(),
                    .pixels = std::uint64_t{options.view.width} * options.view.height,
                    .devices = 1},
                   scene);
    Suspected suspected{clip.name(), clip.topology(), image_params(one, frames), {}, true};
    for (const double frame : chosen) {
        const std::span<const vec3> positions = frames.positions(frame);
        suspected.poses.push_back({frame, {positions.begin(), positions.end()}});
    }
    return suspected;
}

/// At frame 0 as it is, at frame 1 with its axes exchanged, which is exact.
Suspected make_failure_scene(const Options& options, const FailureScene& scene) {
    const WorldBounds bounds = bounds_of(scene.positions);
    const SceneSpace space(bounds);
    Suspected suspected{kFailures + scene.name,
                        scene.topology,
                        make_image_params(options.view, bounds, space),
                        {},
                        false};
    std::vector<vec3> positions(scene.positions.size());
    space.to_scene(scene.positions, positions);
    suspected.poses.push_back({0, positions});
    for (vec3& p : positions) p = vec3(p.y, p.z, p.x);
    suspected.poses.push_back({1, std::move(positions)});
    return suspected;
}

/// The meshes that "failures:NAME" or "failures:all" names.
std::vector<Suspected> failure_scenes_of(const Options& options, const std::string& wanted) {
    std::vector<Suspected> scenes;
    std::string names;
    for (const FailureScene& scene : suspect_scenes()) {
        names += (names.empty() ? "" : ", ") + scene.name;
        if (wanted == kFailures + std::string("all") || wanted == kFailures + scene.name)
            scenes.push_back(make_failure_scene(options, scene));
    }
    if (!scenes.empty()) return scenes;
    throw Error(ErrorKind::kBadArgument,
                fmt::format("{}: there is no such mesh; failures:NAME is one of all, {}",
                            shown(wanted), names));
}

std::vector<std::byte> picture_of(const ImageParams& params, const Judged& judged) {
    Image image{params.width, params.height, {}};
    for (std::size_t i = 0; i < judged.hits.size(); ++i) {
        const std::uint8_t fault = judged.fault_of_ray[i];
        const std::uint32_t grey = judged.hits[i].prim_id == kNoPrim ? 0xFF303030 : 0xFFA0A0A0;
        image.pixels.push_back(fault == 0 ? grey : colour_of(static_cast<Fault>(fault - 1)));
    }
    return encode_png(image);
}

class DriverJudge {
public:
    DriverJudge(const Options& options, const Messages& messages)
        : options_(options),
          messages_(messages),
          driver_(make_driver_rays(options.suspect.value_or(""), options.backend)),
          ours_(make_backend(BackendChoice::kCpu, options.backend, messages)) {
        std::vector<std::string> line = {"morphray"};
        line.insert(line.end(), options.arguments.begin(), options.arguments.end());
        run_.driver = driver_->description();
        run_.command = shell_line(line);
        run_.width = options.view.width;
        run_.height = options.view.height;
        if (!options.hits.empty())
            call_library([&] { hits_.emplace(options.view.width, options.view.height); });
    }

    ExitCode run() {
        for (const std::string& name : options_.scenes) {
            if (name.starts_with(kFailures)) {
                for (const Suspected& scene : failure_scenes_of(options_, name)) judge(scene);
            } else {
                judge(open_clip_scene(options_, name, messages_));
            }
        }
        write_reports();
        return run_.wrong() == 0 ? ExitCode::kOk : ExitCode::kCheckFailed;
    }

private:
    void judge(const Suspected& scene) {
        Progress progress("judging", "", 2 * scene.poses.size(), progress_mode(options_));
        std::uint64_t done = 0;
        for (const Suspected::Pose& pose : scene.poses) {
            progress.begin(fmt::format("frame {}", pose.frame), StepPart::kShown);
            const Bvh bvh = build_bvh(scene.topology, pose.positions);
            const PosedMesh mesh{scene.topology, pose.positions, bvh,
                                 is_closed(scene.topology, pose.positions)};
            const bool is_first = &pose == &scene.poses.front();
            if (is_first) {
                hold(mesh);
                judge_pose(scene, pose, mesh, "built");
            } else {
                // Shrinking leaves another mesh.
                driver_->set_scene(scene.topology, (&pose - 1)->positions);
                const bool is_update = driver_->update(pose.positions);
                ours_->set_scene(scene.topology, pose.positions, bvh);
                judge_pose(scene, pose, mesh, is_update ? "updated" : "rebuilt");
                progress.update(++done);
                driver_->set_scene(scene.topology, (&pose - 1)->positions);
                driver_->rebuild(pose.positions);
                ours_->set_scene(scene.topology, pose.positions, bvh);
                if (is_update) judge_pose(scene, pose, mesh, "rebuilt");
            }
            progress.update(++done);
        }
        progress.finish();
    }

    /// The reproducer of a kind on the fewest triangles.
    struct Smallest {
        int tries = 0;
        std::size_t triangles = std::numeric_limits<std::size_t>::max();
        std::string reproducer;
    };

    /// Whether one more finding of a kind is worth shrinking.
    bool tries_to_shrink(Fault fault) {
        constexpr int kTries = 6;
        constexpr std::size_t kSmall = 2;
        Smallest& smallest = smallest_[fault];
        return smallest.triangles > kSmall && ++smallest.tries <= kTries;
    }

    void hold(const PosedMesh& mesh) {
        driver_->set_scene(mesh.topology, mesh.positions);
        ours_->set_scene(mesh.topology, mesh.positions, mesh.bvh);
    }

    void judge_pose(const Suspected& scene, const Suspected::Pose& pose, const PosedMesh& mesh,
                    const char* structure) {
        const double build_ms = driver_->times().build_ms;
        const std::vector<Ray> camera = camera_rays(scene.params);
        const std::vector<Ray> aimed =
            aimed_rays(scene.topology, pose.positions, kAimedRays,
                       1 + static_cast<std::uint64_t>(&pose - scene.poses.data()));
        struct Shrinkable {
            Finding finding;
            Ray ray;
            std::size_t described;
        };
        std::vector<Shrinkable> found;
        for (const auto& [view, rays] : {std::pair("camera", &camera), {"aimed", &aimed}}) {
            throw_if_interrupted();
            Judged judged = judge_suspect(*driver_, *ours_, mesh, *rays, kDescribed);
            SuspectRow& row = run_.rows.emplace_back();
            row = {scene.name,   scene.topology.triangles.size(), pose.frame, structure, view,
                   judged.counts};
            row.hits_hash = Hasher().add(std::span(judged.hits)).digest();
            row.build_ms = build_ms;
            row.trace_ms = driver_->times().trace_ms;
            const bool is_camera = rays == &camera;
            if (is_camera) keep_hits(judged);
            if (is_camera && judged.counts.wrong() > 0 && run_.pictures.size() < kPictures)
                run_.pictures.push_back({place_of(row, ""), picture_of(scene.params, judged)});
            for (const Finding& finding : judged.findings) {
                if (++described_[{scene.name, finding.fault, is_camera}] > kDescribed) continue;
                describe_finding(scene, pose, row, finding, is_camera);
                if (tries_to_shrink(finding.fault))
                    found.push_back({finding, (*rays)[finding.ray], run_.findings.size() - 1});
            }
        }
        // Last, since it leaves other meshes in both tracers.
        for (const Shrinkable& one : found) {
            SuspectFinding& finding = run_.findings[one.described];
            const auto part =
                shrink(*driver_, *ours_, mesh, one.ray, one.finding, throw_if_interrupted);
            // It may depend on the rest of the structure; another one of its kind may not.
            if (!part) continue;
            finding.reproducer = text_of(*part, finding.place, run_.driver);
            finding.triangles = part->topology.triangles.size();
            Smallest& smallest = smallest_[finding.fault];
            if (finding.triangles < smallest.triangles)
                smallest = {smallest.tries, finding.triangles, finding.reproducer};
        }
    }

    static std::string place_of(const SuspectRow& row, const std::string& ray) {
        return fmt::format("{}, frame {}, structure {}{}", row.scene, row.frame, row.structure,
                           ray);
    }

    void describe_finding(const Suspected& scene, const Suspected::Pose& pose,
                          const SuspectRow& row, const Finding& finding, bool is_camera) {
        SuspectFinding& described = run_.findings.emplace_back();
        described.fault = finding.fault;
        described.description = describe(finding);
        if (!is_camera) {
            described.place = place_of(row, fmt::format(", aimed ray {}", finding.ray));
            return;
        }
        const std::size_t x = finding.ray % scene.params.width;
        const std::size_t y = finding.ray / scene.params.width;
        described.place = place_of(row, fmt::format(", pixel {},{}", x, y));
        if (!scene.is_clip) return;
        std::vector<std::string> line = {"morphray",
                                         "probe",
                                         scene.name,
                                         "--frame",
                                         fmt::format("{}", pose.frame),
                                         "--pixel",
                                         fmt::format("{},{}", x, y),
                                         "--size",
                                         fmt::format("{}x{}", run_.width, run_.height)};
        Options one = options_;
        one.scene = scene.name;
        const std::vector<std::string> viewed = scene_view_arguments(one);
        line.insert(line.end(), viewed.begin(), viewed.end());
        described.probe = shell_line(line);
    }

    void keep_hits(const Judged& judged) {
        if (!hits_) return;
        morphray::Image image;
        image.width = run_.width;
        image.height = run_.height;
        image.occlusion.resize(judged.hits.size());
        for (const Hit& hit : judged.hits) {
            morphray::Hit kept;
            if (hit.prim_id != kNoPrim) {
                kept.t = hit.t;
                kept.u = hit.u;
                kept.v = hit.v;
                kept.geom_id = 0;
                kept.prim_id = hit.prim_id;
            }
            image.hits.push_back(kept);
        }
        call_library([&] { hits_->add(image); });
    }

    void write_reports() {
        const std::filesystem::path folder = options_.out;
        for (const auto& [fault, smallest] : smallest_) {
            if (smallest.reproducer.empty()) continue;
            make_output_folder(folder);
            std::string name = name_of(fault);
            std::ranges::replace(name, ' ', '_');
            write_file(folder / (name + ".c"), smallest.reproducer);
        }
        if (hits_) call_library([&] { hits_->write(options_.hits); });
        if (!options_.json.empty()) write_report(options_.json, suspect_json(run_));
        if (!options_.html.empty()) write_report(options_.html, suspect_html(run_));
        if (!takes_stdout({options_.json, options_.html})) messages_.print(suspect_text(run_));
    }

    const Options& options_;
    const Messages& messages_;
    std::unique_ptr<DriverRays> driver_;
    std::unique_ptr<Backend> ours_;
    SuspectRun run_;
    std::optional<morphray::HitsWriter> hits_;
    std::map<std::tuple<std::string, Fault, bool>, std::size_t> described_;
    std::map<Fault, Smallest> smallest_;
};

}  // namespace

ExitCode judge_driver(const Options& given, const Messages& messages) {
    Options options = given;
    if (!options.size_given) options.view.width = options.view.height = kDefaultSide;
    if (options.out.empty()) options.out = "out/suspect";
    check_reports({options.json, options.html, options.hits});
    return DriverJudge(options, messages).run();
}

}  // namespace mray::app
