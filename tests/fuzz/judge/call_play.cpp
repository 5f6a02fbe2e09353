#include "tests/fuzz/judge/call_play.h"

#include <algorithm>
#include <bit>
#include <thread>
#include <utility>

#include "tests/fuzz/generate/generator.h"
#include "tests/fuzz/judge/call_questions.h"

namespace mray::fuzz {
namespace {

using morphray::Device;
using morphray::Scene;
using morphray::SceneOptions;

[[noreturn]] void refuse() {
    throw morphray::Error(morphray::ErrorCode::bad_argument, "the model refuses it");
}

std::vector<morphray::MeshView> views_of(CallMeshes meshes) {
    std::vector<morphray::MeshView> views;
    for (const auto& mesh : meshes) views.push_back(mesh->view());
    return views;
}

SceneOptions make_options(std::uint64_t seed, std::span<const Device> devices) {
    Dice dice(seed);
    SceneOptions options;
    if (dice.one_in(2)) {
        const dvec3 half = dvec3(1, 1, 1) + dice.point(0.9);
        const dvec3 centre = dice.point(0.5);
        const dvec3 lower = centre - half;
        const dvec3 upper = centre + half;
        options.bounds = morphray::Box{{lower.x, lower.y, lower.z}, {upper.x, upper.y, upper.z}};
    }
    constexpr std::array kBudgets = {0.0, 0.75, 10.0, 1000.0};
    switch (dice.from(0, 5)) {
        case 0:
            options.update = morphray::Refit{};
            break;
        case 1:
            options.update = morphray::Rebuild{};
            break;
        case 2:
            options.update = morphray::Every{static_cast<std::uint32_t>(dice.from(1, 3))};
            break;
        default: {
            morphray::Auto policy{.deterministic = !dice.one_in(8)};
            policy.budget = dice.pick(kBudgets);
            if (dice.one_in(3)) policy.budget_ms = dice.pick(kBudgets);
            options.update = policy;
        }
    }
    if (dice.one_in(4)) options.split = morphray::Split::sweep;
    options.record_cost_ratio = dice.one_in(4);
    if (dice.one_in(6) && devices.size() > 1) options.refit_on = devices[1];
    return options;
}

}  // namespace

LibraryScene::LibraryScene(CallMeshes meshes, const Device& device, const SceneOptions& options)
    : scene_(Scene::build(views_of(meshes), device, options)) {}

std::unique_ptr<PlayedScene> LibraryScene::on(const Device& device) {
    return std::unique_ptr<PlayedScene>(new LibraryScene(scene_.on(device)));
}

std::uint32_t LibraryScene::attach(const std::shared_ptr<CallMesh>& mesh) {
    return scene_.attach(mesh->view());
}

void LibraryScene::detach(std::uint32_t geom_id) { scene_.detach(geom_id); }

void LibraryScene::update() { scene_.update(); }

void LibraryScene::update_with_new_bounds() { scene_.update_with_new_bounds(); }

void LibraryScene::update(std::uint32_t geom_id, std::size_t first, std::size_t count) {
    scene_.update(geom_id, first, count);
}

ModelScene::ModelScene(CallMeshes meshes, const Device& brute,
                       const std::optional<morphray::Box>& bounds)
    : brute_(brute), bounds_(bounds) {
    // Throws what it should.
    Scene::build(views_of(meshes), brute, {.bounds = bounds});
    for (const auto& mesh : meshes) meshes_.push_back({mesh, mesh->positions()});
    positions_changed();
}

ModelScene::ModelScene(const ModelScene& other)
    : brute_(other.brute_), bounds_(other.bounds_), meshes_(other.meshes_), next_(other.next_) {}

std::unique_ptr<PlayedScene> ModelScene::on(const Device& /*device*/) {
    return std::unique_ptr<PlayedScene>(new ModelScene(*this));
}

std::uint32_t ModelScene::attach(const std::shared_ptr<CallMesh>& mesh) {
    Scene::build(mesh->view(), brute_);
    std::vector<Mesh> next = next_.value_or(meshes_);
    std::uint32_t id = 0;
    while (id < next.size() && next[id].mesh != nullptr) ++id;
    if (id == next.size()) next.emplace_back();
    next[id] = {mesh, {}};
    next_ = std::move(next);
    return id;
}

void ModelScene::detach(std::uint32_t geom_id) {
    std::vector<Mesh> next = next_.value_or(meshes_);
    if (geom_id >= next.size() || next[geom_id].mesh == nullptr) refuse();
    next[geom_id] = {};
    next_ = std::move(next);
}

void ModelScene::update() {
    if (next_) meshes_ = *std::exchange(next_, std::nullopt);
    for (Mesh& mesh : meshes_) {
        if (mesh.mesh == nullptr) continue;
        if (mesh.mesh->deforms() || mesh.positions.empty()) mesh.positions = mesh.mesh->positions();
    }
    positions_changed();
}

void ModelScene::update_with_new_bounds() {
    bounds_.reset();
    update();
}

void ModelScene::update(std::uint32_t geom_id, std::size_t first, std::size_t count) {
    if (geom_id >= meshes_.size() || meshes_[geom_id].mesh == nullptr || next_) refuse();
    Mesh& mesh = meshes_[geom_id];
    if (first > mesh.positions.size() || count > mesh.positions.size() - first) refuse();
    const std::vector<vec3> now = mesh.mesh->positions();
    for (std::size_t i = first; i < first + count; ++i) mesh.positions[i] = now[i];
    positions_changed();
}

/// Without bounds, those of the first finite positions are taken.
void ModelScene::positions_changed() {
    scene_.reset();
    if (bounds_) return;
    WorldBounds bounds;
    for (const Mesh& mesh : meshes_) {
        const WorldBounds more = bounds_of(mesh.positions);
        if (!more.empty()) bounds.extend(more.lower, more.upper);
    }
    if (bounds.empty()) return;
    const auto point = [](const double(&p)[3]) { return morphray::Point{p[0], p[1], p[2]}; };
    bounds_ = morphray::Box{point(bounds.lower), point(bounds.upper)};
}

const Scene& ModelScene::scene() {
    if (scene_) return *scene_;
    std::vector<morphray::MeshView> views;
    for (const Mesh& mesh : meshes_)
        views.push_back(mesh.mesh == nullptr ? morphray::MeshView{}
                                             : mesh.mesh->view(mesh.positions));
    scene_ = Scene::build(views, brute_, {.bounds = bounds_});
    return *scene_;
}

CallPlay::CallPlay(std::span<const Device> devices)
    : devices_(devices), brute_(Device::brute_force({.threads = 1})) {}

/// Mostly the first one.
const Device& CallPlay::device(std::uint64_t seed) const {
    if (devices_.empty()) return brute_;
    Dice dice(seed);
    return dice.one_in(3) ? devices_[dice.below(static_cast<std::uint32_t>(devices_.size()))]
                          : devices_.front();
}

CallAnswer CallPlay::play(const Call& call) {
    CallAnswer answer;
    Slot& slot = slots_[call.scene];
    if (slot.scene == nullptr && call.kind != CallKind::kBuild && call.kind != CallKind::kOn)
        return answer;
    with_error_code(answer, [&] {
        if (call.kind >= CallKind::kRays) {
            ask(call, slot, answer);
        } else {
            change(call, answer);
        }
    });
    return answer;
}

void CallPlay::build(const Call& call, Slot& slot) {
    std::vector<std::shared_ptr<CallMesh>> meshes;
    for (std::uint32_t i = 0; i < call.number; ++i)
        meshes.push_back(std::make_shared<CallMesh>(case_seed(call.seed, i)));
    const SceneOptions options = make_options(call.seed, devices_);
    std::unique_ptr<PlayedScene> scene;
    if (devices_.empty()) {
        scene = std::make_unique<ModelScene>(meshes, brute_, options.bounds);
    } else {
        scene = std::make_unique<LibraryScene>(meshes, device(call.seed), options);
    }
    meshes_.insert(meshes_.end(), meshes.begin(), meshes.end());
    slot.scene = std::move(scene);
    slot.meshes = std::move(meshes);
}

void CallPlay::change(const Call& call, CallAnswer& answer) {
    Slot& slot = slots_[call.scene];
    CallMesh* const mesh =
        call.number < slot.meshes.size() ? slot.meshes[call.number].get() : nullptr;
    switch (call.kind) {
        case CallKind::kBuild:
            build(call, slot);
            break;
        case CallKind::kDestroy:
            slot.scene.reset();
            slot.meshes.clear();
            break;
        case CallKind::kOn: {
            const Slot& from = slots_[call.number % kCallScenes];
            if (from.scene == nullptr) break;
            slot.scene = from.scene->on(device(call.seed));
            slot.meshes = from.meshes;
            break;
        }
        case CallKind::kAttach: {
            auto attached = std::make_shared<CallMesh>(call.seed);
            meshes_.push_back(attached);
            const std::uint32_t id = slot.scene->attach(attached);
            answer.push_back({"geom_ids", {id}});
            slot.meshes.resize(std::max<std::size_t>(slot.meshes.size(), id + 1));
            slot.meshes[id] = std::move(attached);
            break;
        }
        case CallKind::kDetach:
            slot.scene->detach(call.number);
            break;
        case CallKind::kMove:
            if (mesh != nullptr) mesh->move(call.seed);
            break;
        case CallKind::kPart: {
            Dice dice(call.seed);
            const std::uint32_t count =
                mesh != nullptr ? static_cast<std::uint32_t>(mesh->vertex_count()) : 0;
            const std::uint32_t first = dice.below(count + 1);
            const std::uint32_t part = dice.below(count - first + 1);
            slot.scene->update(call.number, first, dice.one_in(8) ? count + 1 : part);
            break;
        }
        default:
            if (Dice(call.seed).one_in(4)) {
                slot.scene->update_with_new_bounds();
            } else {
                slot.scene->update();
            }
    }
}

void CallPlay::ask(const Call& call, Slot& slot, CallAnswer& answer) {
    std::vector<vec3> positions;
    std::vector<uvec3> triangles;
    for (const auto& mesh : slot.meshes) {
        if (mesh == nullptr) continue;
        const auto first = static_cast<std::uint32_t>(positions.size());
        for (const uvec3& t : mesh->triangles()) triangles.push_back(t + first);
        const std::vector<vec3> more = mesh->positions();
        positions.insert(positions.end(), more.begin(), more.end());
    }
    const Surroundings around(positions, triangles);
    const Scene& scene = slot.scene->scene();
    const morphray::Box box = scene.bounds();
    CallPart shape{"bounds and sizes", {}};
    for (const morphray::Point& p : {box.lower, box.upper})
        for (const double x : p)
            shape.bits.push_back(std::bit_cast<std::uint32_t>(static_cast<float>(x) + 0.0f));
    shape.bits.push_back(static_cast<std::uint32_t>(scene.triangle_count()));
    shape.bits.push_back(static_cast<std::uint32_t>(scene.vertex_count()));
    answer.push_back(std::move(shape));
    PlayedScene* const next = slots_[(call.scene + 1) % kCallScenes].scene.get();
    const Scene* const other = next != nullptr ? &next->scene() : nullptr;
    const auto ask_all = [&](CallAnswer& answers) {
        with_error_code(answers, [&] {
            if (call.kind == CallKind::kRays) {
                ask_about_rays(scene, other, call, around, answers);
            } else if (call.kind == CallKind::kPoints) {
                ask_about_points(scene, call, around, answers);
            } else {
                ask_for_image(scene, call, around, answers);
            }
        });
    };
    // Sometimes two threads ask at the same time. The model answers once.
    Dice dice(call.seed);
    CallAnswer second;
    if (dice.one_in(4)) {
        if (devices_.empty()) {
            ask_all(answer);
            second.assign(answer.begin() + 1, answer.end());
        } else {
            std::thread thread([&] { ask_all(second); });
            ask_all(answer);
            thread.join();
        }
    } else {
        ask_all(answer);
    }
    answer.insert(answer.end(), second.begin(), second.end());
}

}  // namespace mray::fuzz
