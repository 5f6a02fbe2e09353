// Tasks that write outputs behind the work that goes on.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace mray::app {

/// Runs tasks one after the other, in the order in which they were added, in a thread of its own.
/// After a task that throws no other one runs. For one caller.
class OutputQueue {
public:
    /// add() waits until at most `most` tasks are unfinished. 0: until its own task has run.
    explicit OutputQueue(std::size_t most);
    /// Waits for all tasks; errors are lost. After a signal tasks that have not begun are dropped,
    /// and the process may end before the last one has.
    ~OutputQueue();
    OutputQueue(const OutputQueue&) = delete;
    OutputQueue& operator=(const OutputQueue&) = delete;

    /// Throws the error of an earlier task.
    void add(std::function<void()> task);
    /// Waits for all tasks. Throws the error of one of them.
    void finish();

private:
    void run();
    void wait_for(std::size_t most);

    std::size_t most_;
    std::mutex mutex_;
    std::condition_variable changed_;
    /// The task that runs is the first.
    std::deque<std::function<void()>> tasks_;
    std::exception_ptr error_;
    bool ends_ = false;
    std::thread thread_;
};

}  // namespace mray::app
