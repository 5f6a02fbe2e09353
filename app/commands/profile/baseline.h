// Compares a run of `profile` with the report of an earlier one.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "app/report/profile_report.h"

namespace mray::app {

/// Reads a report of `profile --json` that can be compared with a run that has the head, rays and
/// options of `report` (its rows are not read). Throws Error(kBadInput) that names the file and the
/// first difference, or what is wrong with the file.
ProfileReport read_baseline(const std::string& file, const ProfileReport& report);

/// Throws Error(kBadInput) unless the baseline has just these frames on this backend.
void require_frames(const std::string& file, const ProfileReport& baseline,
                    const std::string& backend, std::span<const double> frames);

/// Throws Error(kBadInput) if the baseline has a backend that is not among these.
void require_backends(const std::string& file, const ProfileReport& baseline,
                      const std::vector<std::string>& backends);

/// Compares each stage on each backend. A stage is expected to take as long as in the baseline,
/// times the ratio of this run's yardstick to the baseline's at the same frame. Requires the rows
/// of one to be those of the other.
BaselineReport compare_with_baseline(const std::string& file, const ProfileReport& baseline,
                                     const ProfileReport& report, double tolerance_percent);

}  // namespace mray::app
