// The clip of a command with its scene space and the frames that are asked for.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/messages.h"
#include "app/options.h"
#include "common/clip.h"
#include "common/pose.h"
#include "common/scene_keyframes.h"
#include "common/scene_space.h"

namespace morphray::app {

/// A clip and the vertex positions of one of its frames at a time.
class SceneFrames {
public:
    explicit SceneFrames(std::unique_ptr<Clip> clip);

    const Clip& clip() const { return *clip_; }
    const SceneSpace& space() const { return space_; }

    /// Positions of a frame in scene space, valid until the next call. Throws Error(kBadInput).
    std::span<const vec3> positions(double frame);
    /// The frame without its positions, where keyframes will do; they are made when they are asked
    /// for, once, and before the next call. Throws Error(kBadInput).
    Pose pose(double frame);
    /// What making positions has taken since pose() was called.
    double deform_ms() const { return deform_ms_; }

private:
    std::unique_ptr<Clip> clip_;
    SceneSpace space_;
    SceneKeyframes keyframes_;
    double deform_ms_ = 0;
    std::vector<vec3> scene_;
};

/// Opens options.scene after an estimate of what it takes; its warnings go to `messages`.
SceneFrames open_frames(const Options& options, const Messages& messages);

enum class DefaultFrames { kAll, kFew, kFirst };

/// The frames of --frames, or else: every whole frame; at most about four, with the first, the
/// middle and the last; the first. Never empty. Throws Error(kUsage).
std::vector<double> select_frames(const Options& options, const Clip& clip,
                                  DefaultFrames otherwise);

/// Warns of files of the clip that cannot be used, unless the frames (or --build-at) need one of
/// them: then that error tells.
void warn_of_damage(const Options& options, const Clip& clip, std::span<const double> frames,
                    const Messages& messages);

/// Throws Error(kUsage) for a frame outside the clip.
void require_in_clip(const char* option, double frame, const Clip& clip);

/// "0007", or "0007.25" between whole frames: sorts by name as by number.
std::string frame_label(double frame);

}  // namespace morphray::app
