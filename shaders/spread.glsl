// The order of workgroups.
#ifndef SHADERS_SPREAD_GLSL
#define SHADERS_SPREAD_GLSL

/// Neighbouring workgroups go to the two halves of the grid in turn: lavapipe gives each thread one
/// contiguous half (quarter, ...) of it, and pictures are busier in some places than in others.
uint spread_group(uint group, uint count) {
    uint half_count = (count + 1u) / 2u;
    return group < half_count ? 2u * group : 2u * (group - half_count) + 1u;
}

#endif  // SHADERS_SPREAD_GLSL
