#include "app/commands/render/output_queue.h"

#include <utility>

#include "app/terminal/interrupt.h"

namespace mray::app {

OutputQueue::OutputQueue(std::size_t most) : most_(most), thread_([this] { run(); }) {}

OutputQueue::~OutputQueue() {
    {
        const std::scoped_lock lock(mutex_);
        ends_ = true;
        if (interrupted() && tasks_.size() > 1) tasks_.resize(1);
    }
    changed_.notify_all();
    thread_.join();
}

void OutputQueue::add(std::function<void()> task) {
    {
        const std::scoped_lock lock(mutex_);
        tasks_.push_back(std::move(task));
    }
    changed_.notify_all();
    wait_for(most_);
}

void OutputQueue::finish() { wait_for(0); }

void OutputQueue::wait_for(std::size_t most) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return tasks_.size() <= most; });
    if (error_) std::rethrow_exception(error_);
}

void OutputQueue::run() {
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait(lock, [&] { return ends_ || !tasks_.empty(); });
        if (tasks_.empty()) return;
        // References to elements of a deque stay valid while others are added.
        std::function<void()>& task = tasks_.front();
        if (!error_) {
            lock.unlock();
            std::exception_ptr error;
            try {
                task();
            } catch (...) {
                error = std::current_exception();
            }
            lock.lock();
            error_ = error;
        }
        tasks_.pop_front();
        changed_.notify_all();
    }
}

}  // namespace mray::app
