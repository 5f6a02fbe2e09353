// The state of the viewer, which input changes, and the images that it asks for.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec4.hpp>
#include "app/base/messages.h"
#include "app/base/options.h"

#include "common/scene/camera_setup.h"
#include "morphray/scene.hpp"
#include "scenes/animation.h"

namespace mray::app {

/// A pinhole camera that orbits its target, apart from it and off the direction of `up`.
class Camera {
public:
    /// `view` has both eye and target, apart, and an `up` that is not parallel to the view.
    explicit Camera(const morphray::View& view);

    const Point& eye() const { return eye_; }
    const Point& target() const { return target_; }
    const Point& up() const { return up_; }
    double fov_degrees() const { return fov_; }
    double distance() const;

    /// `around` the up direction and `over` towards it, in radians; a degree away from the poles.
    void orbit(double around, double over);
    /// Moves by parts of the image's height at the target. `down` is that of the pointer.
    void pan(double right, double down);
    /// Multiplies the distance from the target, which stays within 1e-6 and 1e6 of the first one.
    void zoom(double factor);

private:
    Point eye_;
    Point target_;
    Point up_;
    double fov_;
    double first_distance_;
};

/// The frame that is shown, and how it goes on.
class Playback {
public:
    /// `start` is in [first, last].
    Playback(double first, double last, double start) : first_(first), last_(last), frame_(start) {}

    double frame() const { return frame_; }
    double first() const { return first_; }
    double last() const { return last_; }

    /// Lets `seconds` of wall time pass: moves on if it is playing, and begins again at the end.
    void advance(double seconds);
    /// Shows the possible frame that is nearest to this one.
    void seek(double frame);
    /// Stops, and goes by whole frames from the nearest one.
    void step(int frames);

    bool playing = false;
    double frames_a_second = 24;

private:
    double first_;
    double last_;
    double frame_;
};

struct ImageRequest {
    double frame = 0;
    /// A world_view().
    morphray::View view;
    PolicySpec update;
    /// Two backends are compared.
    std::vector<BackendChoice> backends;
    /// The depth of the boxes that are wanted from the first backend's tree; below 0 for none.
    int box_depth = -1;

    bool operator==(const ImageRequest& other) const;

    /// Whether it takes so long that a newer request should end it.
    bool is_refined() const {
        return view.samples > 1 || (view.shading == morphray::Shading::lit && view.ao_count > 0);
    }
};

struct ViewState {
    Playback playback;
    Camera camera;
    /// The world_view() of the options, whose camera the one above replaces.
    morphray::View view;
    PolicySpec update = {};
    BackendChoice backend = BackendChoice::kAuto;
    bool shows_difference = false;
    int box_depth = -1;
    bool shows_panel = true;
};

/// The state at the start. Throws Error for an impossible view.
ViewState initial_state(const ViewOptions& options, const Animation& animation, double frame);

/// The steps from a fast image, 0, by ambient occlusion and 4 and 16 samples to the one wanted.
int last_step(const ViewState& state);

ImageRequest request_of(const ViewState& state, int step);

/// Both ends of each edge, in clip space of the camera of a view that gives eye and target.
std::vector<glm::vec4> box_lines(const morphray::View& view, std::span<const morphray::Box> boxes);

}  // namespace mray::app
