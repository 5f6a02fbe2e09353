// The rows of a table on stdout, as they are made.
#pragma once

#include <exception>
#include <string>
#include <string_view>

#include "app/terminal/messages.h"

namespace mray::app {

/// Prints rows as they are made. What cannot be printed ends no measurement before finish().
class ShownRows {
public:
    /// The header is printed before the first row. Nothing is printed unless `is_shown`.
    ShownRows(std::string header, bool is_shown, const Messages& messages);

    /// Lines, each with its end.
    void add(std::string_view rows);
    /// Throws Error if something could not be printed.
    void finish() const;

private:
    const Messages& messages_;
    /// Empty once it is printed.
    std::string header_;
    bool is_shown_;
    std::exception_ptr failure_;
};

}  // namespace mray::app
