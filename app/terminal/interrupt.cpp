#include "app/terminal/interrupt.h"

#include <signal.h>
#include <unistd.h>

#include "common/base/watch.h"

namespace mray::app {
namespace {

std::atomic<int> received_signal = SIGINT;
std::atomic<bool> has_received = false;
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

void on_signal(int signal) {
    if (has_received.exchange(true)) ::_exit(128 + signal);
    received_signal = signal;
}

}  // namespace

void handle_signals() {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP})
        if (::signal(signal, on_signal) == SIG_IGN) ::signal(signal, SIG_IGN);
    ::signal(SIGPIPE, SIG_IGN);
}

const std::atomic<bool>& interrupt_flag() { return has_received; }

int interrupt_signal() { return received_signal; }

void throw_if_interrupted() {
    if (interrupted()) throw Error(ErrorKind::kCancelled, kWorkCancelled);
}

}  // namespace mray::app
