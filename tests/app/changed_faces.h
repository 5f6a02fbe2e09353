// A sequence whose topology changes without its numbers of vertices and faces.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {

/// Renders one on this backend under every update: each ends at the frame with other faces.
inline void expect_changed_faces_refused(const std::string& backend) {
    const TemporaryFolder folder;
    for (const int frame : {0, 1, 2})
        folder.write(fmt::format("f_{}.obj", frame), square_of_frame(frame, 2));
    for (const char* update : {"refit", "rebuild", "auto"}) {
        const Outcome outcome =
            run({"render", folder.file("f_%d.obj"), "--size", "16x16", "--backend", backend,
                 "--update", update, "--frames", "0..2", "--out", folder.file("out")});
        EXPECT_EQ(outcome.code, 8) << update;
        EXPECT_NE(outcome.err.find("frame 2 has other vertices in face 1"), std::string::npos)
            << outcome.err;
        EXPECT_TRUE(std::filesystem::exists(folder.path() / "out/frame_0001.png"));
        EXPECT_FALSE(std::filesystem::exists(folder.path() / "out/frame_0002.png"));
    }
}

}  // namespace mray::test
