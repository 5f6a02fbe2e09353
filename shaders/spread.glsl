// The order of workgroups.
#ifndef SHADERS_SPREAD_GLSL
#define SHADERS_SPREAD_GLSL

/// Of two neighbouring workgroups one goes to each half of the grid, in turn the first and the second
/// in the order of A. Thue, as rows may be a power of two of groups: lavapipe gives each thread one
/// contiguous half (quarter, ...) of the grid, and pictures are busier in some places than in others.
uint spread_group(uint group, uint count) {
    uint half_count = (count + 1u) / 2u;
    bool is_second = group >= half_count;
    uint pair = is_second ? group - half_count : group;
    uint swapped = 2u * pair + 1u < count ? uint(bitCount(pair)) & 1u : 0u;
    return 2u * pair + ((is_second ? 1u : 0u) ^ swapped);
}

#endif  // SHADERS_SPREAD_GLSL
