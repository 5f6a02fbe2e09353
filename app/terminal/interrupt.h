// SIGINT, SIGTERM and SIGHUP end a command at the next piece of its work.
#pragma once

#include <atomic>

namespace mray::app {

/// From now on the first of these signals sets the flag, and the second one ends the process at
/// once. A signal that is ignored (nohup) stays so. A write to a closed pipe fails with EPIPE.
void handle_signals();

/// Whether a signal has arrived: for calls that take a flag by which they are cancelled.
const std::atomic<bool>& interrupt_flag();
inline bool interrupted() { return interrupt_flag().load(); }
/// The signal that has arrived; SIGINT without one.
int interrupt_signal();

/// Throws Error(kCancelled) if interrupted(). Called between pieces of work, so that what is
/// finished is kept and no file is half written.
void throw_if_interrupted();

}  // namespace mray::app
