// SIGINT, SIGTERM and SIGHUP end a command at the next piece of its work.
#pragma once

#include <atomic>
#include <string>

#include "app/base/exit_code.h"

namespace mray::app {

/// From now on the first SIGINT, SIGTERM or SIGHUP makes interrupted() true, and the second one
/// ends the process at once. A signal that is ignored (nohup) stays so. SIGPIPE becomes ignored, so
/// that a write to a closed pipe fails with EPIPE.
void handle_signals();

/// Whether one of these signals has arrived. Thread-safe, as all of these functions.
bool interrupted();

/// True as interrupted() is: for calls that take a flag by which they are cancelled.
const std::atomic<bool>& interrupt_flag();

/// Throws Error(kCancelled) if interrupted(). Called between pieces of work, so that what is
/// finished is kept and no file is half written.
void throw_if_interrupted();

/// Such as "interrupted; finished results are kept".
std::string interrupt_message();

/// kTerminated after SIGTERM, kHungUp after SIGHUP, otherwise kInterrupted.
ExitCode interrupt_exit_code();

}  // namespace mray::app
