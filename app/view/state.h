// The state of the viewer, which input changes, and the images that it asks for.
#pragma once

#include <glm/vec4.hpp>
#include "app/base/messages.h"
#include "app/base/options.h"

#include "common/scene/camera_setup.h"
#include "morphray/scene.hpp"

namespace mray::app {

/// A pinhole camera that orbits its target, apart from it and off the direction of `up`.
struct Camera {
    /// `view` has both eye and target, apart, and an `up` that is not parallel to the view.
    explicit Camera(const morphray::View& view);

    double distance() const { return glm::distance(eye, target); }
    /// `around` the up direction and `over` towards it, in radians; a degree away from the poles.
    void orbit(double around, double over);
    /// Moves by parts of the image's height at the target. `down` is that of the pointer.
    void pan(double right, double down);
    /// Multiplies the distance from the target, which stays within 1e-6 and 1e6 of the first one.
    void zoom(double factor);

    glm::dvec3 eye;
    glm::dvec3 target;
    glm::dvec3 up;
    /// In degrees.
    double fov;
    double first_distance;
};

/// The frame that is shown, in [first, last], and how it goes on.
struct Playback {
    double first = 0;
    double last = 0;
    double frame = 0;
    bool playing = false;
    double frames_a_second = 24;

    /// Lets `seconds` of wall time pass: moves on if it is playing, and begins again at the end.
    void advance(double seconds);
    /// Shows the possible frame that is nearest to this one.
    void seek(double to);
    /// Stops, and goes by whole frames from the nearest one.
    void step(int frames);
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
    /// Asks for the hits of this pixel instead of the image.
    std::optional<Pixel> pixel = {};

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
ViewState initial_state(const Options& options, const Animation& animation, double frame);

/// The steps from a fast image, 0, by ambient occlusion and 4 and 16 samples to the one wanted.
int last_step(const ViewState& state);

ImageRequest request_of(const ViewState& state, int step);

/// Both ends of each edge, in clip space of the camera of a view that gives eye and target.
std::vector<glm::vec4> box_lines(const morphray::View& view, std::span<const morphray::Box> boxes);

}  // namespace mray::app
