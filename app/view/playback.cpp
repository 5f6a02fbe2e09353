#include "app/view/playback.h"

#include <algorithm>
#include <cmath>

namespace mray::app {
namespace {

constexpr double kParts = 64;

}  // namespace

Playback::Playback(double first, double last, double start)
    : first_(first), last_(last), frame_(start), time_(start) {}

void Playback::advance(double seconds) {
    if (!playing || !(seconds > 0) || last_ <= first_) return;
    double time = time_ + seconds * frames_a_second;
    if (time >= last_) {
        playing = loop;
        time = loop ? first_ + std::fmod(time - first_, last_ - first_) : last_;
    }
    seek(time);
    time_ = time;
}

void Playback::seek(double frame) {
    frame_ = std::clamp(std::round(frame * kParts) / kParts, first_, last_);
    time_ = frame_;
}

void Playback::step(int frames) {
    playing = false;
    seek(std::round(frame_) + frames);
}

}  // namespace mray::app
