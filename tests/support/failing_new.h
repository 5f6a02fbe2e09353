// An operator new that fails, for programs that link failing_new.cpp.
#pragma once

namespace mray::test {

/// The number of allocations of this thread that succeed before one fails; below 0 none fails.
extern thread_local long allocations_left;

}  // namespace mray::test
