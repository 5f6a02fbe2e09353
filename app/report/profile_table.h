// The times of stages as tables.
#pragma once

#include <string>

#include "app/report/profile_report.h"
#include "tools/text/table.h"

namespace mray::app {

/// A row for each frame and backend with all columns, for CSV.
Table profile_table(const ProfileReport& report);

/// The same for a terminal, of at most 100 columns, with what its headings mean.
std::string profile_text(const ProfileReport& report);

/// A row for each backend and stage, and lines that say how many became slower and why some have no
/// verdict. At most 100 columns, apart from the name of the file.
std::string baseline_text(const BaselineReport& report);

/// "too short", "unsure", "ok", "slower" or "faster".
const char* name_of(StageVerdict verdict);

}  // namespace mray::app
