// What kernels do for lavapipe (Mesa 22.3 to 25.0), and what it costs a GPU: nothing.
//
// 1. It silently ends the loops of an invocation after 65,535 iterations together. Its invocation
//    is a vector of at most 16 lanes, and at least one lane counts each iteration. So a lane has a
//    budget of steps, and a ray that has used it up is suspended and continued by `resume`:
//    - A lane exceeds its budget by less than 400: a leaf, a stack of pops.
//    - Saving and loading a suspended ray and drawing a direction take fewer than 1000 iterations
//      for all lanes together.
//    - 16 * (3500 + 400) + 1000 < 65,535.
//    For queries, a search among repeated triangles takes fewer than kRepeatsSteps iterations,
//    loading and saving a state some 490, and a lane exceeds its budget by less than 350:
//    16 * (3000 + 350 + 70 + 490) + 300 < 65,535.
//    A GPU has budgets too, so that no dispatch takes seconds, but far larger ones.
// 2. It reads texels three times as fast as storage buffers (base/buffers.glsl).
// 3. Each of its threads takes a contiguous part of a dispatch (spread_group below).
#ifndef SHADERS_BASE_LAVAPIPE_H
#define SHADERS_BASE_LAVAPIPE_H

#include "common/interop/platform.h"

SHARED_BEGIN

SHARED_CONST uint kStepBudget = 3500u;
SHARED_CONST uint kQueryStepBudget = 3000u;
SHARED_CONST uint kRepeatsSteps = 70u;

SHARED_END

#ifndef __cplusplus

/// Permutes workgroups so that two neighbours go to different halves of the grid: some places of an
/// image take longer than others. A. Thue's sequence chooses the half: with plain alternation the
/// halves would be columns of the image if a row has an even number of workgroups.
uint spread_group(uint group, uint count) {
#ifdef STORAGE_BUFFERS
    return group;
#else
    uint half_count = (count + 1u) / 2u;
    bool is_second = group >= half_count;
    uint pair = is_second ? group - half_count : group;
    uint swapped = 2u * pair + 1u < count ? uint(bitCount(pair)) & 1u : 0u;
    return 2u * pair + ((is_second ? 1u : 0u) ^ swapped);
#endif
}

#endif

#endif  // SHADERS_BASE_LAVAPIPE_H
