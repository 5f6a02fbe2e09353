// Keeps queries and changes of a scene apart.
#pragma once

#include <atomic>

#include "morphray/error.hpp"

namespace morphray::python {

/// Either any number of queries or one change at a time use a scene. C++ leaves a query during an
/// update undefined; here it is an error.
class UseCount {
public:
    void begin_query() {
        int uses = uses_.load();
        do {
            if (uses == kChanging)
                throw Error(ErrorCode::busy, "another thread is changing this scene");
        } while (!uses_.compare_exchange_weak(uses, uses + 1));
    }
    void end_query() { --uses_; }

    void begin_change() {
        int uses = 0;
        if (uses_.compare_exchange_strong(uses, kChanging)) return;
        throw Error(ErrorCode::busy, uses == kChanging
                                         ? "another thread is changing this scene"
                                         : "another thread has a query running in this scene; a "
                                           "change needs the scene for itself");
    }
    void end_change() { uses_ = 0; }

private:
    static constexpr int kChanging = -1;
    /// Queries that run now, or kChanging.
    std::atomic<int> uses_ = 0;
};

class QueryUse {
public:
    explicit QueryUse(UseCount& count) : count_(count) { count_.begin_query(); }
    ~QueryUse() { count_.end_query(); }
    QueryUse(const QueryUse&) = delete;

private:
    UseCount& count_;
};

class ChangeUse {
public:
    explicit ChangeUse(UseCount& count) : count_(count) { count_.begin_change(); }
    ~ChangeUse() { count_.end_change(); }
    ChangeUse(const ChangeUse&) = delete;

private:
    UseCount& count_;
};

}  // namespace morphray::python
