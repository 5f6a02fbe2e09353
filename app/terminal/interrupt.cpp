#include "app/terminal/interrupt.h"

#include <fmt/format.h>

#include <atomic>

namespace mray::app {
namespace {

/// The signal that arrived, or 0. A signal handler can only use a global.
std::atomic<int> received_signal = 0;
std::atomic<bool> has_received = false;
static_assert(std::atomic<bool>::is_always_lock_free &&
              std::atomic<int>::is_always_lock_free);  // required in a signal handler

constexpr std::array<int, 4> kSignals = {SIGINT, SIGTERM, SIGHUP, SIGPIPE};

void set_handler(int signal, void (*handler)(int)) {
    struct sigaction action = {};
    action.sa_handler = handler;
    action.sa_flags = SA_RESTART;
    sigemptyset(&action.sa_mask);
    sigaction(signal, &action, nullptr);
}

void on_signal(int signal) {
    received_signal.store(signal);
    has_received.store(true);
    for (const int next : {SIGINT, SIGTERM, SIGHUP}) set_handler(next, SIG_DFL);
}

}  // namespace

InterruptGuard::InterruptGuard() : before_() {
    received_signal.store(0);
    has_received.store(false);
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

const std::atomic<bool>& interrupt_flag() { return has_received; }

bool interrupted() { return received_signal.load() != 0; }

void throw_if_interrupted() {
    if (!interrupted()) return;
    const int signal = received_signal.load();
    throw Error(ErrorKind::kCancelled,
                fmt::format("{}; finished results are kept", signal == SIGTERM  ? "terminated"
                                                             : signal == SIGHUP ? "hung up"
                                                                                : "interrupted"));
}

ExitCode interrupt_exit_code() {
    const int signal = received_signal.load();
    if (signal == SIGHUP) return ExitCode::kHungUp;
    return signal == SIGTERM ? ExitCode::kTerminated : ExitCode::kInterrupted;
}

}  // namespace mray::app
