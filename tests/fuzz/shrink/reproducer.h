// Writes a case as files and a command line.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/fuzz/judge/referee.h"

namespace mray::fuzz {

/// A pose as the text of an OBJ file, which reads back exactly.
std::string obj_text(const FuzzCase& fuzz_case, std::size_t pose);

/// The arguments of `morphray crosscheck` (without the program) that compare the case's image on
/// this tracer, with the scene in `folder`.
std::vector<std::string> crosscheck_arguments(const FuzzCase& fuzz_case, const Variant& variant,
                                              const std::string& folder);

/// How to reproduce a failure.
struct Reproducer {
    /// The command line, from the folder of the checkout; empty if the program has no such tracer.
    std::string line;
    /// Whether `program` was run with the line and found a difference; and a remark on it.
    bool reproduces = false;
    std::string remark;
};

/// Writes case.txt, the OBJ sequence, files of single rays and points, and cmd.sh with the line
/// into `folder`, and runs the line if `program` exists. Throws Error(kOutput).
Reproducer write_reproducer(const FuzzCase& fuzz_case, const Finding& finding,
                            const std::filesystem::path& folder,
                            const std::filesystem::path& program, const std::string& remarks);

}  // namespace mray::fuzz
