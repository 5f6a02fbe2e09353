// Cases as text: the corpus' format.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "tests/fuzz/case/fuzz_case.h"

namespace morphray::fuzz {

/// Reads back bit for bit: floats are hexadecimal, and those that are no number are their bits.
/// `remarks` are put before it, each line as a comment.
std::string to_text(const FuzzCase& fuzz_case, const std::string& remarks = {});

/// Throws Error(kBadInput), `name:line: what is wrong`.
FuzzCase read_case(std::string_view text, const std::string& name);
/// Likewise, also for a file that cannot be read.
FuzzCase read_case_file(const std::filesystem::path& path);

}  // namespace morphray::fuzz
