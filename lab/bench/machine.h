// The machine on which the figures are measured.
#pragma once

#include <string>

namespace mray::bench {

/// The name of the results file: the processor's name, family and model, and how many cores; for
/// example "amd-epyc-zen5-family26-model2-2c". Names alone do not tell generations apart.
std::string machine_name();

/// The widest vector instructions of this machine: "AVX-512", "AVX2", "SSE4.1", or "".
std::string machine_isa();

}  // namespace mray::bench
