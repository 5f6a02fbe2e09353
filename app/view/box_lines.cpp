#include "app/view/window.h"

#include <cmath>
#include <numbers>
#include <utility>

#include <glm/geometric.hpp>

namespace mray::app {
namespace {

using glm::dvec3;

/// The image of points: (x, y) in pixels, and the depth along the view.
class Projection {
public:
    explicit Projection(const ViewSpec& view) : eye_(to_dvec3(*view.eye)) {
        forward_ = to_dvec3(*view.target) - eye_;
        near_ = 1e-3 * glm::length(forward_);
        forward_ = glm::normalize(forward_);
        right_ = glm::normalize(glm::cross(forward_, to_dvec3(view.up)));
        up_ = glm::cross(right_, forward_);
        scale_ = view.height / (2 * std::tan(view.fov * std::numbers::pi / 360));
        middle_ = {view.width / 2.0, view.height / 2.0, 0};
    }

    /// Across, down, and along the view.
    dvec3 to_camera(const dvec3& p) const {
        const dvec3 q = p - eye_;
        return {glm::dot(q, right_), -glm::dot(q, up_), glm::dot(q, forward_)};
    }

    /// Appends the part of a line that is before the eye.
    void add(dvec3 a, dvec3 b, std::vector<ImageLine>& lines) const {
        if (a.z > b.z) std::swap(a, b);
        if (!(b.z > near_)) return;
        if (a.z < near_) a += (b - a) * ((near_ - a.z) / (b.z - a.z));
        const dvec3 p = middle_ + a * (scale_ / a.z);
        const dvec3 q = middle_ + b * (scale_ / b.z);
        lines.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(q.x),
                         static_cast<float>(q.y)});
    }

private:
    dvec3 eye_;
    dvec3 forward_;
    dvec3 right_;
    dvec3 up_;
    dvec3 middle_;
    double scale_ = 1;
    double near_ = 0;
};

}  // namespace

std::vector<ImageLine> box_lines(const ViewSpec& view, std::span<const morphray::Box> boxes) {
    std::vector<ImageLine> lines;
    const Projection projection(view);
    for (const morphray::Box& box : boxes) {
        dvec3 corners[8];
        for (unsigned i = 0; i < 8; ++i) {
            corners[i] = projection.to_camera({(i & 1 ? box.upper : box.lower)[0],
                                               (i & 2 ? box.upper : box.lower)[1],
                                               (i & 4 ? box.upper : box.lower)[2]});
        }
        for (unsigned i = 0; i < 8; ++i) {
            for (unsigned axis = 1; axis < 8; axis *= 2) {
                if ((i & axis) == 0) projection.add(corners[i], corners[i | axis], lines);
            }
        }
    }
    return lines;
}

}  // namespace mray::app
