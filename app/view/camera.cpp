#include "app/view/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

namespace mray::app {
namespace {

using glm::dvec3;

constexpr double kPole = std::numbers::pi / 180;
constexpr double kZoomRange = 1e6;

struct Axes {
    dvec3 right;
    dvec3 up;
    dvec3 forward;
};

Axes axes_of(const Point& eye, const Point& target, const Point& up) {
    const dvec3 forward = glm::normalize(to_dvec3(target) - to_dvec3(eye));
    const dvec3 right = glm::normalize(glm::cross(forward, glm::normalize(to_dvec3(up))));
    return {right, glm::cross(right, forward), forward};
}

/// The height of the image at depth 1.
double slope(double fov_degrees) { return 2 * std::tan(fov_degrees * std::numbers::pi / 360); }

}  // namespace

Camera::Camera(const ResolvedView& view, const Point& up, double fov_degrees)
    : eye_(view.eye),
      target_(view.target),
      up_(up),
      fov_(fov_degrees),
      first_distance_(glm::length(to_dvec3(eye_) - to_dvec3(target_))) {}

double Camera::distance() const { return glm::length(to_dvec3(eye_) - to_dvec3(target_)); }

void Camera::orbit(double around, double over) {
    const dvec3 pole = glm::normalize(to_dvec3(up_));
    const Axes axes = axes_of(eye_, target_, up_);
    const dvec3 level = glm::cross(pole, axes.right);
    const double length = distance();
    // The eye's direction from the target is cos(height) * level + sin(height) * pole.
    const double height = std::asin(std::clamp(-glm::dot(axes.forward, pole), -1.0, 1.0));
    const double limit = std::numbers::pi / 2 - kPole;
    const double new_height = std::clamp(height + over, -limit, limit);
    const dvec3 away = -level;
    const dvec3 turned = std::cos(around) * away + std::sin(around) * glm::cross(pole, away);
    eye_ = to_point(to_dvec3(target_) +
                    length * (std::cos(new_height) * turned + std::sin(new_height) * pole));
}

void Camera::pan(double right, double down) {
    const Point moved = drag_at(distance(), right, down);
    eye_ = to_point(to_dvec3(eye_) - to_dvec3(moved));
    target_ = to_point(to_dvec3(target_) - to_dvec3(moved));
}

void Camera::zoom(double factor) {
    const double length =
        std::clamp(distance() * factor, first_distance_ / kZoomRange, first_distance_ * kZoomRange);
    const Axes axes = axes_of(eye_, target_, up_);
    eye_ = to_point(to_dvec3(target_) - length * axes.forward);
}

void Camera::fly(double right, double up, double forward) {
    const Axes axes = axes_of(eye_, target_, up_);
    const dvec3 moved = right * axes.right + up * axes.up + forward * axes.forward;
    eye_ = to_point(to_dvec3(eye_) + moved);
    target_ = to_point(to_dvec3(target_) + moved);
}

Point Camera::drag_at(double depth, double right, double down) const {
    const Axes axes = axes_of(eye_, target_, up_);
    const double height = depth * slope(fov_);
    return to_point(height * (right * axes.right - down * axes.up));
}

}  // namespace mray::app
