// Time in the viewer.
#pragma once

namespace mray::app {

/// The frame that is shown, and how it goes on. Frames are multiples of 1/64, which decimal text
/// keeps exactly, so that a command can name them, and the first and last frame of the clip.
class Playback {
public:
    /// `start` is in [first, last].
    Playback(double first, double last, double start);

    double frame() const { return frame_; }
    double first() const { return first_; }
    double last() const { return last_; }

    /// Lets `seconds` of wall time pass: moves on if it is playing. At the end it begins again, or
    /// stops if it does not loop.
    void advance(double seconds);
    /// Shows a frame, the nearest possible one, and forgets what advance() has left over.
    void seek(double frame);
    /// Stops, and goes by whole frames from the nearest one.
    void step(int frames);

    bool playing = false;
    bool loop = true;
    /// Frames of the clip a second.
    double frames_a_second = 24;

private:
    double first_;
    double last_;
    double frame_;
    /// The exact time, of which frame_ is the nearest multiple.
    double time_;
};

}  // namespace mray::app
