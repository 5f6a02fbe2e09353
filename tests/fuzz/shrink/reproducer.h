// A case as files and one line of the shell, for people and for the program.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/fuzz/judge/referee.h"

namespace morphray::fuzz {

/// A pose as the text of an OBJ file: floats read back as themselves.
std::string obj_text(const FuzzCase& fuzz_case, std::size_t pose);

/// The arguments of `morphray crosscheck` (without the program) that compare the case's image on
/// this tracer, with the scene in `folder`.
std::vector<std::string> crosscheck_arguments(const FuzzCase& fuzz_case, const Entrant& entrant,
                                              const std::string& folder);

/// A failure as it is handed over.
struct Reproducer {
    /// What to type, from the folder of the checkout; empty where the program has no such tracer.
    std::string line;
    /// Whether the program at `program` was run with it and found a difference; what else happened.
    bool reproduces = false;
    std::string remark;
};

/// Writes case.txt, the OBJ sequence, for single rays a file of them, and cmd.sh with the line into
/// `folder`, and runs the line if `program` exists. Throws Error(kOutput).
Reproducer write_reproducer(const FuzzCase& fuzz_case, const Finding& finding,
                            const std::filesystem::path& folder,
                            const std::filesystem::path& program, const std::string& remarks);

}  // namespace morphray::fuzz
