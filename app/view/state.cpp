#include "app/view/state.h"

#include <numbers>
#include <tuple>

#include <glm/gtc/matrix_transform.hpp>

#include "app/animation/animation_scene.h"

namespace mray::app {
namespace {

using glm::dvec3;
using morphray::Shading;

constexpr double kPole = std::numbers::pi / 180;
constexpr double kZoomRange = 1e6;
constexpr std::uint32_t kSamples[] = {1, 4, 16, 64};

Axes axes_of(const Camera& camera) {
    return mray::axes_of(glm::normalize(camera.target - camera.eye), camera.up);
}

bool has_ao(const ViewState& state) {
    return state.view.shading == Shading::lit && state.view.ao_count > 0;
}

}  // namespace

Camera::Camera(const morphray::View& view)
    : eye(to_dvec3(*view.eye)),
      target(to_dvec3(*view.target)),
      up(to_dvec3(view.up)),
      fov(view.fov),
      first_distance(distance()) {}

void Camera::orbit(double around, double over) {
    const dvec3 pole = glm::normalize(up);
    const Axes axes = axes_of(*this);
    const dvec3 away = -glm::cross(pole, axes.right);
    // The eye's direction from the target is cos(height) * away + sin(height) * pole.
    const double height = std::asin(std::clamp(-glm::dot(axes.forward, pole), -1.0, 1.0));
    const double limit = std::numbers::pi / 2 - kPole;
    const double new_height = std::clamp(height + over, -limit, limit);
    const dvec3 turned = std::cos(around) * away + std::sin(around) * glm::cross(pole, away);
    eye = target + distance() * (std::cos(new_height) * turned + std::sin(new_height) * pole);
}

void Camera::pan(double right, double down) {
    const Axes axes = axes_of(*this);
    const double height = distance() * 2 * std::tan(fov * std::numbers::pi / 360);
    const dvec3 moved = height * (right * axes.right - down * axes.up);
    eye -= moved;
    target -= moved;
}

void Camera::zoom(double factor) {
    const double length =
        std::clamp(distance() * factor, first_distance / kZoomRange, first_distance * kZoomRange);
    eye = target - length * axes_of(*this).forward;
}

void Playback::advance(double seconds) {
    if (!playing || !(seconds > 0) || last <= first) return;
    frame = first + std::fmod(frame - first + seconds * frames_a_second, last - first);
}

void Playback::seek(double to) { frame = std::clamp(to, first, last); }

void Playback::step(int frames) {
    playing = false;
    seek(std::round(frame) + frames);
}

bool ImageRequest::operator==(const ImageRequest& other) const {
    const auto tied = [](const ImageRequest& r) {
        const morphray::View& v = r.view;
        return std::tie(r.frame, v.eye, v.target, v.up, v.fov, v.light, v.width, v.height, v.rays,
                        v.shading, v.samples, v.flat, v.ao_count, v.ao_distance, r.update,
                        r.backends, r.box_depth, r.pixel);
    };
    return tied(*this) == tied(other);
}

ViewState initial_state(const Options& options, const Animation& animation, double frame) {
    const morphray::View view = world_view(options.view, animation);
    return {.playback = {.first = animation.first_frame(),
                         .last = animation.last_frame(),
                         .frame = frame,
                         .playing = options.plays},
            .camera = Camera(view),
            .view = view,
            .update = options.tree.update,
            .backend = options.backend.choice};
}

int last_step(const ViewState& state) {
    const auto* const found =
        std::find(std::begin(kSamples), std::end(kSamples), state.view.samples);
    return static_cast<int>(found - std::begin(kSamples)) + (has_ao(state) ? 1 : 0);
}

ImageRequest request_of(const ViewState& state, int step) {
    ImageRequest request;
    const int level = has_ao(state) ? std::max(step - 1, 0) : step;
    request.frame = state.playback.frame;
    request.view = state.view;
    request.view.eye = to_point(state.camera.eye);
    request.view.target = to_point(state.camera.target);
    if (has_ao(state) && step == 0) request.view.ao_count = 0;
    if (state.view.shading != Shading::lit && state.view.ao_count == 0) request.view.ao_count = 1;
    request.view.samples =
        kSamples[std::min<std::size_t>(static_cast<std::size_t>(level), std::size(kSamples) - 1)];
    request.update = state.update;
    request.backends = {state.backend};
    if (state.shows_difference) request.backends = {BackendChoice::kCpu, BackendChoice::kVulkan};
    request.box_depth = state.box_depth;
    return request;
}

std::vector<glm::vec4> box_lines(const morphray::View& view, std::span<const morphray::Box> boxes) {
    const glm::dvec3 eye = to_dvec3(*view.eye);
    const glm::dvec3 target = to_dvec3(*view.target);
    const double aspect = static_cast<double>(view.width) / view.height;
    const glm::dmat4 camera = glm::infinitePerspective(glm::radians(view.fov), aspect,
                                                       1e-3 * glm::distance(eye, target)) *
                              glm::lookAt(eye, target, to_dvec3(view.up));
    std::vector<glm::vec4> ends;
    for (const morphray::Box& box : boxes) {
        const auto corner = [&](unsigned i) {
            return glm::vec4(camera * glm::dvec4((i & 1 ? box.upper : box.lower)[0],
                                                 (i & 2 ? box.upper : box.lower)[1],
                                                 (i & 4 ? box.upper : box.lower)[2], 1));
        };
        for (unsigned i = 0; i < 8; ++i) {
            for (const unsigned axis : {1u, 2u, 4u})
                if ((i & axis) == 0) ends.insert(ends.end(), {corner(i), corner(i | axis)});
        }
    }
    return ends;
}

}  // namespace mray::app
