// Cases as text, the format of the corpus.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "tests/fuzz/case/fuzz_case.h"

namespace mray::fuzz {

/// The case as text that reads back bit for bit: floats are hexadecimal, NaN is written as its
/// bits. Each line of `remarks` precedes it as a comment.
std::string to_text(const FuzzCase& fuzz_case, const std::string& remarks = {});

/// Reads the text of a case. Throws Error(kBadInput), `name:line: problem`.
FuzzCase read_case(std::string_view text, const std::string& name);
/// Reads a file. Throws as read_case, also if the file cannot be read.
FuzzCase read_case_file(const std::filesystem::path& path);

}  // namespace mray::fuzz
