// A run of the program, and the files that it writes.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "tests/app/program.h"

namespace mray::test {

inline const std::vector<std::string> kWork = {"render",    "builtin:cloth:500",
                                               "--backend", "cpu",
                                               "--frames",  "0..3",
                                               "--threads", "2",
                                               "--size",    "32x32",
                                               "--out",     "out",
                                               "--hits",    "hits",
                                               "--quiet"};

/// Bytes of files by their names, without what a killed process was writing.
using Outputs = std::map<std::string, std::string>;

inline Outputs outputs_of(const TemporaryFolder& folder) {
    Outputs files;
    for (const std::string& name : folder.names()) {
        const std::filesystem::path path = folder.path() / name;
        if (std::filesystem::is_regular_file(path) && !name.ends_with(".partial"))
            files[name] = read_file(path);
    }
    return files;
}

inline Outputs outputs_of_a_run() {
    const TemporaryFolder folder;
    const Outcome outcome = run(kWork, {.folder = folder.path()});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outputs_of(folder);
}

/// Expects each file to be that of the complete run.
inline void expect_whole(const Outputs& outputs, const Outputs& complete) {
    for (const auto& [name, bytes] : outputs) {
        const auto known = complete.find(name);
        ASSERT_NE(known, complete.end()) << "an unexpected file: " << name;
        EXPECT_EQ(bytes, known->second) << name;
    }
}

}  // namespace mray::test
