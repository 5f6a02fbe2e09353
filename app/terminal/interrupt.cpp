#include "app/terminal/interrupt.h"

#include <signal.h>
#include <unistd.h>

#include "common/base/watch.h"

namespace mray::app {
namespace {

std::atomic<int> received_signal = 0;
std::atomic<bool> has_received = false;
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

void on_signal(int signal) {
    int none = 0;
    if (!received_signal.compare_exchange_strong(none, signal)) ::_exit(128 + signal);
    has_received.store(true);
}

void set_handler(int signal, void (*handler)(int)) {
    struct sigaction action = {};
    sigaction(signal, nullptr, &action);
    if (action.sa_handler == SIG_IGN) return;
    action.sa_handler = handler;
    action.sa_flags = SA_RESTART;
    sigaction(signal, &action, nullptr);
}

}  // namespace

void handle_signals() {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) set_handler(signal, on_signal);
    set_handler(SIGPIPE, SIG_IGN);
}

bool interrupted() { return has_received.load(); }

const std::atomic<bool>& interrupt_flag() { return has_received; }

void throw_if_interrupted() {
    if (interrupted()) throw Error(ErrorKind::kCancelled, kWorkCancelled);
}

std::string interrupt_message() {
    const int signal = received_signal.load();
    const std::string name = signal == SIGTERM  ? "terminated"
                             : signal == SIGHUP ? "hung up"
                                                : "interrupted";
    return name + "; finished results are kept";
}

ExitCode interrupt_exit_code() {
    const int signal = received_signal.load();
    if (signal == SIGHUP) return ExitCode::kHungUp;
    return signal == SIGTERM ? ExitCode::kTerminated : ExitCode::kInterrupted;
}

}  // namespace mray::app
