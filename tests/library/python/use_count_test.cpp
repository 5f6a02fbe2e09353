// The promise of docs/guide/python.md about threads: queries or one change use a scene, a call that
// meets one that it must not is told so, and nothing waits.
#include "library/python/module/use_guard.h"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>

#include "tests/support/run_together.h"

namespace mray::test {
namespace {

using morphray::Error;
using morphray::ErrorCode;
using morphray::python::ChangeUse;
using morphray::python::QueryUse;
using morphray::python::UseCount;

/// Whether a use of this kind may begin now; otherwise the code of its error is busy.
template <class Use>
bool may_begin(UseCount& count) {
    try {
        const Use use(count);
        return true;
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::busy);
        return false;
    }
}

TEST(UseCount, LetsInQueriesOrOneChange) {
    UseCount count;
    std::optional<QueryUse> first(count);
    std::optional<QueryUse> second(count);
    EXPECT_TRUE(may_begin<QueryUse>(count));
    EXPECT_FALSE(may_begin<ChangeUse>(count));
    first.reset();
    EXPECT_FALSE(may_begin<ChangeUse>(count));
    second.reset();
    std::optional<ChangeUse> change(count);
    EXPECT_FALSE(may_begin<QueryUse>(count));
    EXPECT_FALSE(may_begin<ChangeUse>(count));
    change.reset();
    EXPECT_TRUE(may_begin<ChangeUse>(count));
    EXPECT_TRUE(may_begin<QueryUse>(count));
}

/// A number without a lock stands for the scene.
TEST(UseCount, KeepsTheChangesOfThreadsApart) {
    UseCount count;
    int scene = 0;
    std::atomic<int> changes = 0;
    std::atomic<int> wrong = 0;
    run_together(4, [&](std::size_t thread) {
        for (int i = 0; i < 20000; ++i) {
            try {
                if (thread < 2) {
                    const ChangeUse use(count);
                    ++scene;
                    ++changes;
                } else {
                    const QueryUse use(count);
                    if (scene != changes) ++wrong;
                }
            } catch (const Error& error) {
                if (error.code() != ErrorCode::busy) ++wrong;
            }
        }
    });
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(scene, changes);
    EXPECT_TRUE(may_begin<ChangeUse>(count));
}

}  // namespace
}  // namespace mray::test
