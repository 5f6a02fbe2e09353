// The runs of the program while calls fail or signals arrive, and what they must have written.
#pragma once

#include <iosfwd>
#include <map>
#include <string>
#include <vector>

#include "tests/app/program.h"

namespace mray::test {

struct Work {
    const char* name;
    std::vector<std::string> arguments;
};

/// For the names of tests.
void PrintTo(const Work& work, std::ostream* out);

/// A short run of each command that traces, on a backend. Their paths are relative.
std::vector<Work> works(const char* backend);

/// Short runs that read each kind of file.
std::vector<Work> input_works();

/// Writes what the works read into the folder `in`.
void write_inputs(const TemporaryFolder& folder);

/// Bytes of files by their names.
using Outputs = std::map<std::string, std::string>;

/// All files of a folder but those of the test itself.
Outputs outputs_of(const TemporaryFolder& folder);

/// Expects each file to be whole: equal to that of the complete run, or, with times in it, complete
/// for its kind. A file that the complete run does not write fails the test.
void expect_whole(const Outputs& outputs, const Outputs& complete);

}  // namespace mray::test
