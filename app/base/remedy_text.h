// The program's options in messages about errors that they would avoid.
#pragma once

#include <string>

#include "common/base/errors.h"

namespace mray::app {

/// The text to add to an error's message, such as " or accept it with --lenient"; empty for
/// Remedy::kNone.
const char* remedy_text(Remedy remedy);

/// The error's message with the option that would avoid it.
std::string message_of(const Error& error);

}  // namespace mray::app
