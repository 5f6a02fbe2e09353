// The times of stages as tables.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "app/report/profile_report.h"
#include "common/report/table.h"

namespace mray::app {

/// A row for each frame and backend with all columns, for CSV.
Table profile_table(const ProfileReport& report);

/// The same for a terminal, of at most 100 columns, to be written while rows are made.
class ProfileLines {
public:
    /// Frames of all rows.
    ProfileLines(int repeat, std::span<const double> frames);
    /// The names of the columns, after lines that say what they mean.
    std::string header() const;
    /// A line for each stage.
    std::string rows(const ProfileRow& row) const;

private:
    int repeat_;
    std::vector<Column> columns_;
};

}  // namespace mray::app
