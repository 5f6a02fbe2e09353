// The order of workgroups.
#ifndef SHADERS_BASE_SPREAD_GLSL
#define SHADERS_BASE_SPREAD_GLSL

/// Of two neighbouring workgroups one goes to each half of the grid: lavapipe gives each thread one
/// contiguous half (quarter, ...) of it, and images are busier in some places than in others. Which
/// of the two follows A. Thue's sequence, since a row may have an even number of workgroups, whose
/// halves would then be columns of the image.
uint spread_group(uint group, uint count) {
    uint half_count = (count + 1u) / 2u;
    bool is_second = group >= half_count;
    uint pair = is_second ? group - half_count : group;
    uint swapped = 2u * pair + 1u < count ? uint(bitCount(pair)) & 1u : 0u;
    return 2u * pair + ((is_second ? 1u : 0u) ^ swapped);
}

#endif  // SHADERS_BASE_SPREAD_GLSL
