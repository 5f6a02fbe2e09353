// An arena of more threads than the system has room for is an error that a caller can catch.
#include "common/base/thread_arena.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <fstream>
#include <string>
#include <system_error>

#include "common/base/thread_errors.h"

namespace mray::test {
namespace {

// Sanitizers need address space for themselves.
#ifndef MORPHRAY_SANITIZED
/// Leaves the process so many bytes of address space more than it has.
class MemoryLimit {
public:
    explicit MemoryLimit(rlim_t more) {
        getrlimit(RLIMIT_AS, &before_);
        rlim_t pages = 0;
        std::ifstream("/proc/self/statm") >> pages;
        const rlimit limit{pages * 4096 + more, before_.rlim_max};
        setrlimit(RLIMIT_AS, &limit);
    }
    ~MemoryLimit() { setrlimit(RLIMIT_AS, &before_); }
    MemoryLimit(const MemoryLimit&) = delete;

private:
    rlimit before_ = {};
};

TEST(ThreadArena, OfMoreThreadsThanThereIsRoomForIsAnError) {
    {
        const MemoryLimit limit(100u << 20);
        for (int i = 0; i < 2; ++i) {
            try {
                const ThreadArena arena(500);
                ADD_FAILURE() << "500 threads in 100 MiB";
            } catch (const std::system_error& error) {
                EXPECT_TRUE(is_lack_of_threads(error)) << error.what();
            }
        }
    }
    ThreadArena arena(50);
    std::atomic<int> sum = 0;
    arena.execute([&] { sum += 1; });
    EXPECT_EQ(sum, 1);
    EXPECT_EQ(arena.threads(), 50);
}
#endif

}  // namespace
}  // namespace mray::test
