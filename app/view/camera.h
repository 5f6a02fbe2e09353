// The camera of the viewer: where it is, and how input moves it.
#pragma once

#include "common/scene/camera_setup.h"

namespace mray::app {

/// A pinhole camera that orbits its target. All members keep eye and target apart and the view off
/// the direction of `up`. Lengths are in world space, angles in radians.
class Camera {
public:
    /// `view` has both eye and target, apart, and an `up` that is not parallel to the view.
    Camera(const ResolvedView& view, const Point& up, double fov_degrees);

    const Point& eye() const { return eye_; }
    const Point& target() const { return target_; }
    const Point& up() const { return up_; }
    double fov_degrees() const { return fov_; }
    double distance() const;

    /// Turns the eye around the target: `around` the up direction, and `over` towards it; the eye
    /// stays a degree away from the poles.
    void orbit(double around, double over);
    /// Moves eye and target by parts of the image's height at the target: what is there follows the
    /// pointer. `down` is positive for a pointer that moves down.
    void pan(double right, double down);
    /// Multiplies the distance from the target, which stays within 1e-6 and 1e6 of the first one.
    void zoom(double factor);
    /// Moves eye and target together along the axes of the view.
    void fly(double right, double up, double forward);
    /// The movement in world space of a point at `depth` along the view that follows a pointer over
    /// parts of the image's height.
    Point drag_at(double depth, double right, double down) const;

    bool operator==(const Camera&) const = default;

private:
    Point eye_;
    Point target_;
    Point up_;
    double fov_;
    double first_distance_;
};

}  // namespace mray::app
