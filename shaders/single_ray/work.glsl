// The status of a pass, and its suspended rays.
#include "shaders/kernel_interface.h"

layout(std430, binding = kBindWork) buffer Work {
    WorkHeader header;
    Suspended suspended[];
} work;

/// Leaves the ray to `resume`. The order of the list depends on the schedule; the answers do not.
void suspend(Ray ray, uint answer_index) {
    uint i = atomicAdd(work.header.suspended_count, 1u);
    work.suspended[i].ray = ray;
    work.suspended[i].answer_index = answer_index;
}

void report(uint status_bits) {
    if (status_bits != 0u) atomicOr(work.header.status, status_bits);
}
