#include "library/python/module/interruptible.h"

#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include "library/python/module/gil_release.h"

namespace morphray::python {
namespace {

constexpr std::chrono::milliseconds kBetweenLooks{50};

/// Works for the main thread of Python, one call at a time. It lives as long as the process: a new
/// thread for each call would make oneTBB and the tracer set up their memory of a thread each time.
class Worker {
public:
    /// Throws std::system_error if there can be no thread.
    Worker() {
        std::thread([this] { run(); }).detach();
    }

    bool is_busy() const { return work_ != nullptr; }

    void start(const std::function<void()>& work) {
        {
            const std::scoped_lock lock(mutex_);
            work_ = &work;
        }
        changed_.notify_all();
    }
    /// Whether the work ends within this time.
    bool ends_within(std::chrono::milliseconds time) {
        std::unique_lock lock(mutex_);
        return changed_.wait_for(lock, time, [this] { return work_ == nullptr; });
    }
    /// Waits until the work ends.
    void wait() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return work_ == nullptr; });
    }
    /// Returns the exception that ended the work, or null.
    std::exception_ptr take_error() { return std::exchange(error_, nullptr); }

private:
    [[noreturn]] void run() {
        std::unique_lock lock(mutex_);
        while (true) {
            changed_.wait(lock, [this] { return work_ != nullptr; });
            const std::function<void()>& work = *work_;
            lock.unlock();
            std::exception_ptr error;
            try {
                work();
            } catch (...) {
                error = std::current_exception();
            }
            lock.lock();
            error_ = error;
            work_ = nullptr;
            changed_.notify_all();
        }
    }

    std::mutex mutex_;
    std::condition_variable changed_;
    std::exception_ptr error_;
    /// Null between calls.
    std::atomic<const std::function<void()>*> work_ = nullptr;
};

/// Needs the GIL. Null if there can be no thread. Workers are never destroyed, since static objects
/// that are may be destroyed before their threads end.
Worker* worker() {
    static Worker* worker = nullptr;
    static pid_t owner = 0;
    // Threads do not survive a fork.
    if (worker != nullptr && owner == getpid()) return worker;
    try {
        worker = new Worker;
        owner = getpid();
    } catch (const std::system_error&) {
        return nullptr;
    }
    return worker;
}

bool is_main_thread() {
    const py::object main = py::module_::import("threading").attr("main_thread")().attr("ident");
    return main.equal(py::int_(PyThread_get_thread_ident()));
}

}  // namespace

void run_interruptibly(std::atomic<bool>& cancel, const std::function<void()>& work) {
    Worker* const other = is_main_thread() ? worker() : nullptr;
    // It is busy if a handler of signals calls.
    if (other == nullptr || other->is_busy()) {
        const GilRelease release;
        work();
        return;
    }
    other->start(work);
    const auto wait = [&](auto until) {
        const GilRelease release;
        return until();
    };
    while (!wait([&] { return other->ends_within(kBetweenLooks); })) {
        if (PyErr_CheckSignals() == 0) continue;
        py::error_already_set raised;
        cancel = true;
        wait([&] { other->wait(); });
        other->take_error();
        throw raised;
    }
    if (const std::exception_ptr error = other->take_error()) std::rethrow_exception(error);
}

}  // namespace morphray::python
