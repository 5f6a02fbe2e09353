// What both kinds of profile have in common, and the one that compares policies.
#pragma once

#include <exception>
#include <string>
#include <string_view>

#include "app/base/options.h"
#include "app/report/report_head.h"
#include "app/terminal/failure.h"
#include "app/terminal/messages.h"
#include "scenes/clip.h"

namespace mray::app {

/// The head of a profile's report.
ReportHead profile_head(const ProfileOptions& options, const Clip& clip);

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

/// morphray profile --policies: compares update policies over a clip.
ExitCode profile_policies(const ProfileOptions& options, const Messages& messages);

}  // namespace mray::app
