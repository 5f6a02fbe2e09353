#include "library/python/module/interruptible.h"

#include <sched.h>

#include <csignal>

namespace morphray::python {
namespace {

/// The call of the main thread that SIGINT ends, and the handlers at work in any thread.
std::atomic<std::atomic<bool>*> running = nullptr;
std::atomic<int> handlers = 0;
struct sigaction before;

void on_interrupt(int number) {
    ++handlers;
    if (std::atomic<bool>* const cancel = running) *cancel = true;
    before.sa_handler(number);
    --handlers;
}

/// Python notes signals, and runs their handlers in its main thread when C++ has returned. While
/// this lives, SIGINT ends the call of that thread, too.
class SignalScope {
public:
    explicit SignalScope(std::atomic<bool>& cancel) {
        if (gettid() != getpid() || running != nullptr) return;
        sigaction(SIGINT, nullptr, &before);
        const bool is_handled = (before.sa_flags & SA_SIGINFO) == 0 &&
                                before.sa_handler != SIG_IGN && before.sa_handler != SIG_DFL;
        if (!is_handled) return;
        running = &cancel;
        is_set_ = true;
        struct sigaction action = before;
        action.sa_handler = on_interrupt;
        sigaction(SIGINT, &action, nullptr);
    }
    ~SignalScope() {
        if (!is_set_) return;
        sigaction(SIGINT, &before, nullptr);
        running = nullptr;
        while (handlers > 0) sched_yield();
    }
    SignalScope(const SignalScope&) = delete;

private:
    bool is_set_ = false;
};

}  // namespace

void run_interruptibly(std::atomic<bool>& cancel, const std::function<void()>& work) {
    try {
        const SignalScope scope(cancel);
        const GilRelease release;
        work();
    } catch (...) {
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
        throw;
    }
}

}  // namespace morphray::python
