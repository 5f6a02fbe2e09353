// morphray crosscheck: compares the images of all backends, trees and instruction sets.
#include "app/commands/crosscheck.h"

#include <cstring>
#include <random>

#include "app/animation/animation_scene.h"
#include "app/animation/devices.h"
#include "app/animation/frames.h"
#include "app/commands/commands.h"
#include "library/src/engine.h"

namespace mray::app {
namespace {

namespace engine = morphray::engine;
constexpr double kAffordableTests = 2e9;
using glm::dvec3;

constexpr std::uint32_t kAllHits = std::numeric_limits<std::uint32_t>::max();

/// Places around a mesh. The standard library's distributions differ between libraries.
class Places {
public:
    Places(const Topology& topology, std::span<const vec3> positions)
        : triangles_(topology.triangles), positions_(positions) {
        for (const vec3& p : positions)
            if (is_finite_vertex(p)) box_.extend(p);
        if (box_.empty()) box_.extend({0, 0, 0});
    }

    /// In the box of the mesh, made larger by half on each side.
    vec3 in_room() {
        const dvec3 lower(box_.lower);
        const double x = unit();
        const double y = unit();
        const dvec3 part(x, y, unit());
        return space_.to_scene(vec3(lower + (dvec3(box_.upper) - lower) * (2.0 * part - 0.5)));
    }

    /// A vertex, a point of an edge, a point of a triangle, or a place in the room.
    vec3 any() {
        const auto kind = random_() % 4;
        if (kind == 3 || triangles_.empty()) return in_room();
        const uvec3 t = triangles_[random_() % triangles_.size()];
        const vec3 a = positions_[t.x];
        const vec3 b = positions_[t.y];
        const vec3 c = positions_[t.z];
        if (!is_finite_vertex(a) || !is_finite_vertex(b) || !is_finite_vertex(c)) return in_room();
        const double u = kind == 0 ? 0 : unit();
        const double v = kind == 2 ? unit() * (1 - u) : 0;
        const dvec3 from(a);
        return space_.to_scene(vec3(from + u * (dvec3(b) - from) + v * (dvec3(c) - from)));
    }

    Ray ray() {
        const dvec3 from(in_room());
        const dvec3 to(any());
        constexpr double kInfinity = std::numeric_limits<double>::infinity();
        return mray::to_scene(space_, {from, to - from, 0, kInfinity}).ray;
    }

private:
    double unit() { return static_cast<double>(random_()) * 0x1p-32; }

    std::span<const uvec3> triangles_;
    std::span<const vec3> positions_;
    Box box_;
    /// The identity.
    SceneSpace space_{WorldBounds{}};
    std::mt19937 random_{1};
};

template <class T>
bool same_bits(const T& a, const T& b) {
    static_assert(std::is_trivially_copyable_v<T>);
    return std::memcmp(&a, &b, sizeof(T)) == 0;
}

void mark_hits(const HitLists& expected, const HitLists& actual, std::vector<bool>& differs) {
    auto e = expected.hits.begin();
    auto a = actual.hits.begin();
    for (std::size_t i = 0; i < differs.size(); ++i) {
        const auto e_end = e + expected.listed[i];
        const auto a_end = a + actual.listed[i];
        if (expected.total[i] != actual.total[i] || !std::equal(e, e_end, a, a_end, same_bits<Hit>))
            differs[i] = true;
        e = e_end;
        a = a_end;
    }
}

std::size_t count_true(const std::vector<bool>& values) {
    return static_cast<std::size_t>(std::ranges::count(values, true));
}

}  // namespace

bool brute_is_affordable(double triangles, const morphray::View& view, morphray::Rays rays) {
    const double pixels = static_cast<double>(view.width) * view.height;
    const double rays_per_pixel =
        1.0 + rays_per_hit(static_cast<std::uint32_t>(rays), view.ao_count);
    return triangles * pixels * rays_per_pixel <= kAffordableTests;
}

CheckBatch pseudo_random_batch(const Topology& topology, std::span<const vec3> positions,
                               std::uint32_t count) {
    Places places(topology, positions);
    CheckBatch batch;
    for (std::uint32_t i = 0; i < count; ++i) {
        batch.rays.push_back(places.ray());
        batch.points.push_back(places.any());
    }
    return batch;
}

Answers answers_of(Backend& backend, const CheckBatch& batch) {
    Answers answers;
    backend.query(ListQuery{batch.rays, Crossing::kEach, kAllHits, answers.hits[0]});
    backend.query(ListQuery{batch.rays, Crossing::kOwner, kAllHits, answers.hits[1]});
    answers.windings.resize(batch.points.size());
    backend.query(WindingQuery{batch.points, answers.windings, answers.uncertain});
    std::ranges::sort(answers.uncertain);
    answers.closest.resize(batch.points.size());
    backend.query(ClosestQuery{batch.points, kAnyDistance2, answers.closest});
    return answers;
}

std::vector<QueryDifference> compare_answers(const Answers& expected, const Answers& actual) {
    std::vector<bool> hits(expected.hits[0].total.size());
    for (std::size_t i = 0; i < expected.hits.size(); ++i)
        mark_hits(expected.hits[i], actual.hits[i], hits);
    std::vector<bool> windings(expected.windings.size());
    std::vector<UncertainCrossing> only_one;
    std::ranges::set_symmetric_difference(expected.uncertain, actual.uncertain,
                                          std::back_inserter(only_one));
    for (const UncertainCrossing& crossing : only_one) windings[crossing.point] = true;
    std::size_t closest = 0;
    for (std::size_t i = 0; i < windings.size(); ++i) {
        if (expected.windings[i] != actual.windings[i]) windings[i] = true;
        if (!same_bits(expected.closest[i], actual.closest[i])) ++closest;
    }
    return {{"all_hits", "all hits", count_true(hits)},
            {"winding", "windings", count_true(windings)},
            {"closest", "closest triangles", closest}};
}

namespace {

/// The instruction sets that are compared for --simd: all that this machine has, one, or none.
std::vector<std::string> simd_to_check(const std::string& simd) {
    if (simd == kSimdOff) return {};
    if (!simd.empty()) return {find_simd_target(simd).name};
    std::vector<std::string> names;
    for (const SimdTarget& target : supported_simd_targets()) names.emplace_back(target.name);
    return names;
}

struct CheckedDevices {
    std::optional<morphray::Device> vulkan;
    /// Without SIMD.
    morphray::Device cpu;
    morphray::Device brute;
    /// The CPU with each of the instruction sets; none if only Vulkan is checked.
    std::vector<std::pair<std::string, morphray::Device>> simd;
};

CheckedDevices open_checked_devices(const BackendOptions& options, const Messages& messages) {
    const auto open = [&](BackendChoice choice, const std::string& simd) {
        BackendOptions one = options;
        one.choice = choice;
        one.simd = simd;
        return open_device(one, messages);
    };
    const std::string off(kSimdOff);
    std::optional<morphray::Device> vulkan;
    if (options.choice != BackendChoice::kCpu) vulkan = open(BackendChoice::kVulkan, off);
    CheckedDevices devices = {
        vulkan, open(BackendChoice::kCpu, off), open(BackendChoice::kBrute, off), {}};
    if (options.choice != BackendChoice::kVulkan)
        for (const std::string& simd : simd_to_check(options.simd))
            devices.simd.emplace_back(simd, open(BackendChoice::kCpu, simd));
    return devices;
}

/// Two instances of each backend: one refits its own tree from frame to frame, the other is given
/// trees that the other backend refitted and one built for the frame. Each instruction set of the
/// CPU traces the tree that the CPU refitted and the new one.
class CrossChecker {
public:
    /// Builds at the first of the report's frames. Compares only the CPU without a device.
    CrossChecker(const Options& options, const Animation& animation, const CheckedDevices& devices,
                 Json& report, const Messages& messages)
        : options_(options),
          topology_(animation.topology()),
          devices_(devices),
          report_(report),
          view_(world_view(options.view, animation)),
          // Two kinds of hit lists, windings and closest triangles.
          queries_use_brute_(options.brute_reference.value_or(
              4.0 * options.query_count * triangle_count() <= kAffordableTests)),
          scene_(devices.cpu, {.view = {}, .tree = {.update = {PolicyKind::kRefit}}}, animation,
                 report["frames"].front(), messages),
          cpu_given_(engine::copy_on(devices.cpu, scene_.scene())),
          brute_(engine::copy_on(devices.brute, scene_.scene())) {
        if (!devices.vulkan) return;
        vulkan_refits_ = engine::copy_on(*devices.vulkan, scene_.scene());
        vulkan_given_ = engine::copy_on(*devices.vulkan, scene_.scene());
        report["device"] = devices.vulkan->description();
    }

    /// Compares one frame for every kind of rays, and adds each comparison to the report.
    void check(double frame, Progress& progress) {
        frame_ = frame;
        progress_ = &progress;
        progress.begin(fmt::format("frame {}, tree", frame));
        scene_.advance(frame);
        engine::backend(scene_.scene()).read_tree(cpu_tree_);
        rebuilt_ = build_bvh(topology_, positions(), build_config(options_.backend));
        trace_reference();
        if (options_.query_count > 0) {
            batch_ = pseudo_random_batch(topology_, positions(), options_.query_count);
            expected_answers_ = answers_of(queries_use_brute_ ? *brute_ : *cpu_given_, batch_);
        }
        if (devices_.vulkan) check_vulkan();
        if (options_.backend.choice != BackendChoice::kVulkan) check_cpu();
    }

private:
    struct Expected {
        morphray::Rays rays;
        Frame frame;
        std::string reference;
    };

    std::span<const vec3> positions() const { return engine::positions(scene_.scene()); }

    double triangle_count() const { return static_cast<double>(topology_.triangles.size()); }

    ImageParams params_for(morphray::Rays rays) const {
        morphray::View view = view_;
        view.rays = rays;
        return engine::image_params(scene_.scene(), view);
    }

    void trace_reference() {
        brute_->set_tree(rebuilt_);
        cpu_given_->set_tree(rebuilt_);
        expected_.resize(options_.rays.size());
        for (std::size_t i = 0; i < options_.rays.size(); ++i) {
            const bool is_brute = options_.brute_reference.value_or(
                brute_is_affordable(triangle_count(), options_.view, options_.rays[i]));
            expected_[i].rays = options_.rays[i];
            expected_[i].reference = is_brute ? "brute" : "cpu";
            progress_->begin(fmt::format("frame {}, reference {}, {}", frame_,
                                         expected_[i].reference, name_of_rays(options_.rays[i])));
            (is_brute ? brute_ : cpu_given_)
                ->trace_image(params_for(options_.rays[i]), expected_[i].frame);
        }
    }

    /// `simd` is the backend's instruction set, or ""; `refit_on` what refitted its tree, or "".
    void compare(Backend& backend, const std::string& simd, const std::string& refit_on) {
        CheckedImage image = {
            .backend = backend.info().name, .simd = simd, .refit_on = refit_on, .frame = frame_};
        // The CPU without SIMD over the rebuilt tree is the reference itself.
        const bool is_cpu_reference = image.backend == "cpu" && simd.empty() && refit_on.empty();
        Frame actual;
        for (const Expected& expected : expected_) {
            image.rays = expected.rays;
            image.reference = expected.reference;
            if (is_cpu_reference && image.reference == "cpu") continue;
            progress_->begin(
                fmt::format("frame {}, {}, {}", frame_, image.variant(), name_of_rays(image.rays)));
            backend.trace_image(params_for(expected.rays), actual);
            image.trace_ms = backend.finish().trace_ms;
            add_images(report_, options_, image, expected.frame, actual);
            throw_if_interrupted();
        }
        if (options_.query_count == 0 || (is_cpu_reference && !queries_use_brute_)) return;
        image.reference = queries_use_brute_ ? "brute" : "cpu";
        add_answers(report_, options_, image,
                    compare_answers(expected_answers_, answers_of(backend, batch_)));
    }

    void check_vulkan() {
        vulkan_refits_->refit();
        vulkan_refits_->read_tree(vulkan_tree_);
        add_trees(report_, frame_, bvh_hash(cpu_tree_), bvh_hash(vulkan_tree_));
        compare(*vulkan_refits_, "", "vulkan");
        vulkan_given_->set_tree(cpu_tree_);
        compare(*vulkan_given_, "", "cpu");
        vulkan_given_->set_tree(rebuilt_);
        compare(*vulkan_given_, "", "");
    }

    void check_cpu() {
        compare(engine::backend(scene_.scene()), "", "cpu");
        if (devices_.vulkan) {
            cpu_given_->set_tree(vulkan_tree_);
            compare(*cpu_given_, "", "vulkan");
        }
        cpu_given_->set_tree(rebuilt_);
        compare(*cpu_given_, "", "");
        for (const auto& [simd, device] : devices_.simd) {
            const std::unique_ptr<Backend> backend = engine::copy_on(device, scene_.scene());
            compare(*backend, simd, "cpu");
            backend->set_tree(rebuilt_);
            compare(*backend, simd, "");
        }
    }

    const Options& options_;
    const Topology& topology_;
    const CheckedDevices& devices_;
    Json& report_;
    morphray::View view_;
    bool queries_use_brute_;
    /// Its backend refits the CPU's tree; the others have copies.
    AnimationScene scene_;
    std::unique_ptr<Backend> cpu_given_;
    std::unique_ptr<Backend> brute_;
    std::unique_ptr<Backend> vulkan_refits_;
    std::unique_ptr<Backend> vulkan_given_;
    /// These belong to the frame that is being checked.
    double frame_ = 0;
    Bvh cpu_tree_;
    Bvh vulkan_tree_;
    Bvh rebuilt_;
    Progress* progress_ = nullptr;
    std::vector<Expected> expected_;
    CheckBatch batch_;
    Answers expected_answers_;
};

/// Checks the scenes in turn and writes one set of reports, also about a run that ends early.
class Crosscheck {
public:
    Crosscheck(const Options& options, const Messages& messages)
        : options_(options), messages_(messages), report_(empty_report(options)) {
        if (options.backend.choice != BackendChoice::kVulkan)
            report_["environment"]["simd"] = simd_to_check(options.backend.simd);
    }

    ExitCode run() {
        Failure end;
        ExitCode code = ExitCode::kOk;
        attempt(end, messages_, [&] {
            for (Json& scene : report_["scenes"]) {
                const ExitCode one = check(scene);
                // A scene that could not be opened is worse than one with a missing part.
                if (!scene["equal"])
                    code = ExitCode::kCheckFailed;
                else if (code == ExitCode::kOk ||
                         (code == ExitCode::kPartial && one != ExitCode::kOk))
                    code = one;
            }
        });
        report_["error"] = end.message;
        conclude(report_, unfinished_.empty() ? end.message : unfinished_);
        return write_reports(
            end.code == ExitCode::kOk ? code : end.code, messages_,
            {{options_.json, [&] { return json_text(report_); }},
             {options_.junit, [&] { return to_junit(report_); }},
             {options_.html, [&] { return to_html(report_); }}},
            [&] { return run_text(report_); }, report_["verdict"]);
    }

private:
    ExitCode check(Json& scene) {
        const std::string spec = scene["spec"];
        std::optional<Error> error;
        try {
            check_scene(spec, scene);
        } catch (const Error& thrown) {
            error = thrown;
        }
        for (; warned_ < messages_.warnings().size(); ++warned_)
            scene["warnings"].push_back(messages_.warnings()[warned_]);
        scene["complete"] = !error;
        if (!error) return ExitCode::kOk;
        const ErrorKind kind = error->kind();
        const bool ends_run = kind != ErrorKind::kBadInput && kind != ErrorKind::kBadArgument &&
                              kind != ErrorKind::kLimit;
        const bool names_scene =
            options_.inputs.size() > 1 && kind != ErrorKind::kBadInput && !ends_run;
        const std::string message = (names_scene ? spec + ": " : "") + message_of(*error);
        scene["error"] = message;
        if (unfinished_.empty())
            unfinished_ =
                kind == ErrorKind::kBadInput ? escape(spec) + " could not be read" : message;
        if (ends_run) throw *error;
        const ExitCode code = exit_code_of(kind);
        messages_.error({message, code});
        const bool is_later = code == ExitCode::kBadInput && !scene["rows"].empty();
        return is_later ? ExitCode::kPartial : code;
    }

    void check_scene(const std::string& spec, Json& report) {
        Options options = options_;
        options.source.scene = spec;
        const std::unique_ptr<Animation> opened = open_animation(options.source, messages_);
        const Animation& animation = *opened;
        report["scene"] = animation.name();
        report["triangles"] = animation.topology().triangles.size();
        report["vertices"] = animation.topology().vertex_count;
        const std::vector<double> frames = select_frames(options, animation, DefaultFrames::kFew);
        report["frames"] = frames;
        if (!devices_) {
            if (options.backend.choice != BackendChoice::kCpu)
                for (const morphray::VulkanDeviceInfo& device : vulkan_devices())
                    if (device.index == engine::device_index(options.backend.device))
                        report_["environment"]["devices"].push_back(of(device));
            devices_ = open_checked_devices(options.backend, messages_);
        }
        std::optional<Progress> building(std::in_place, "building the tree", 0, messages_);
        CrossChecker checker(options, animation, *devices_, report, messages_);
        building.reset();
        Progress progress("comparing", frames.size(), messages_);
        std::uint64_t done = 0;
        for (const double frame : frames) {
            checker.check(frame, progress);
            progress.update(++done);
        }
        const auto has_hits = [](const Json& row) { return row["hits"] > 0; };
        if (options.query_count > 0 || std::ranges::any_of(report["rows"], has_hits)) return;
        report["equal"] = false;
        throw Error(
            ErrorKind::kBadArgument,
            "no camera ray hits anything, so nothing was checked; choose --eye and --target");
    }

    const Options& options_;
    const Messages& messages_;
    Json report_;
    /// Why the first scene that is not finished is not; empty if all are.
    std::string unfinished_;
    /// The warnings that a scene of the report has.
    std::size_t warned_ = 0;
    /// Opened for the first scene. They are shared because a device takes a second to start.
    std::optional<CheckedDevices> devices_;
};

/// Compares the digests of the devices that the options choose: the CPU with each instruction set
/// and without SIMD, and each Vulkan device. Brute force would take a minute.
ExitCode check_digests(const BackendOptions& options, const Messages& messages) {
    std::string text;
    std::string different;
    const auto check = [&](BackendChoice choice, const std::string& simd,
                           const std::string& vulkan) {
        BackendOptions one = options;
        one.choice = choice;
        one.simd = simd;
        one.device = vulkan;
        const morphray::Device device = open_device(one, messages);
        const std::string name = fmt::format("{}: {}", device.name(), device.description());
        const Progress progress(name, 0, messages);
        const std::uint64_t digest = call_library([&] { return morphray::digest(device); });
        text += fmt::format("{:016x}  {}\n", digest, name);
        if (digest != morphray::kDigest) different += (different.empty() ? "" : "; ") + name;
        throw_if_interrupted();
    };
    Failure end;
    attempt(end, messages, [&] {
        if (options.choice != BackendChoice::kVulkan) {
            for (const std::string& simd : simd_to_check(options.simd))
                check(BackendChoice::kCpu, simd, "");
            check(BackendChoice::kCpu, std::string(kSimdOff), "");
        }
        if (options.choice == BackendChoice::kCpu) return;
        if (!options.device.empty()) return check(BackendChoice::kVulkan, "", options.device);
        for (const morphray::VulkanDeviceInfo& device : vulkan_devices())
            if (device.unusable.empty())
                check(BackendChoice::kVulkan, "", std::to_string(device.index));
        if (text.empty())
            throw Error(ErrorKind::kUnavailable,
                        "no usable Vulkan device; `morphray devices` says what they lack");
    });
    if (end.code == ExitCode::kOk && !different.empty()) end.code = ExitCode::kCheckFailed;
    const std::string verdict =
        !different.empty() ? fmt::format("different from {:016x}: {}", morphray::kDigest, different)
        : end.message.empty() ? "equal: all digests are the documented one"
                              : "not finished: " + end.message;
    return write_reports(
        end.code, messages, {}, [&] { return text + '\n' + verdict + '\n'; }, verdict);
}

}  // namespace

ExitCode run_crosscheck(const Options& options, const Messages& messages) {
    if (options.digest) return check_digests(options.backend, messages);
    check_reports({options.json, options.junit, options.html});
    return Crosscheck(options, messages).run();
}

}  // namespace mray::app
