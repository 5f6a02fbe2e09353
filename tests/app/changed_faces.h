// A sequence whose topology changes without its numbers of vertices and faces.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {

/// Renders one on this backend under every update: each is refused, and nothing is written.
inline void expect_changed_faces_refused(const std::string& backend) {
    const TemporaryFolder folder;
    for (const int frame : {0, 1, 2})
        folder.write(fmt::format("f_{}.obj", frame), square_of_frame(frame, 2));
    const std::size_t files = folder.names().size();
    for (const char* update : {"refit", "rebuild", "auto"}) {
        const Outcome outcome =
            run({"render", folder.file("f_%d.obj"), "--size", "16x16", "--backend", backend,
                 "--update", update, "--frames", "0..2", "--out", folder.file("out")});
        EXPECT_EQ(outcome.code, 3) << update;
        EXPECT_NE(outcome.err.find("frame 2 has other vertices in face 1"), std::string::npos)
            << outcome.err;
        EXPECT_EQ(folder.names().size(), files);
    }
}

}  // namespace mray::test
