// The order of workgroups.
#ifndef SHADERS_BASE_SPREAD_GLSL
#define SHADERS_BASE_SPREAD_GLSL

/// Permutes workgroups so that two neighbours go to different halves of the grid. Lavapipe gives
/// each thread a contiguous half (quarter, ...) of the grid, and some places of an image take
/// longer than others. A. Thue's sequence chooses the half: with plain alternation the halves would
/// be columns of the image if a row has an even number of workgroups.
uint spread_group(uint group, uint count) {
    uint half_count = (count + 1u) / 2u;
    bool is_second = group >= half_count;
    uint pair = is_second ? group - half_count : group;
    uint swapped = 2u * pair + 1u < count ? uint(bitCount(pair)) & 1u : 0u;
    return 2u * pair + ((is_second ? 1u : 0u) ^ swapped);
}

#endif  // SHADERS_BASE_SPREAD_GLSL
