#include "app/terminal/interrupt.h"

#include <fmt/format.h>

#include <atomic>

namespace mray::app {
namespace {

/// The signal that arrived, or 0. A signal handler can only use a global.
std::atomic<int> received_signal = 0;
static_assert(std::atomic<int>::is_always_lock_free);  // required in a signal handler

constexpr std::array<int, 3> kSignals = {SIGINT, SIGTERM, SIGPIPE};

void set_handler(int signal, void (*handler)(int)) {
    struct sigaction action = {};
    action.sa_handler = handler;
    action.sa_flags = SA_RESTART;
    sigemptyset(&action.sa_mask);
    sigaction(signal, &action, nullptr);
}

void on_signal(int signal) {
    received_signal.store(signal);
    set_handler(SIGINT, SIG_DFL);
    set_handler(SIGTERM, SIG_DFL);
}

}  // namespace

InterruptGuard::InterruptGuard() : before_() {
    received_signal.store(0);
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
        sigaction(kSignals[i], nullptr, &before_[i]);
        if (before_[i].sa_handler == SIG_IGN) continue;
        set_handler(kSignals[i], kSignals[i] == SIGPIPE ? SIG_IGN : on_signal);
    }
}

InterruptGuard::~InterruptGuard() {
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
        sigaction(kSignals[i], &before_[i], nullptr);
    }
}

bool interrupted() { return received_signal.load() != 0; }

void throw_if_interrupted() {
    if (!interrupted()) return;
    throw Error(ErrorKind::kCancelled,
                fmt::format("{}; finished results are kept",
                            received_signal.load() == SIGTERM ? "terminated" : "interrupted"));
}

ExitCode interrupt_exit_code() {
    return received_signal.load() == SIGTERM ? ExitCode::kTerminated : ExitCode::kInterrupted;
}

}  // namespace mray::app
