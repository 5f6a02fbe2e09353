// Images, frames, and what is kept when a frame fails.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/app/program.h"
#include "tests/app/scenes.h"

namespace mray::test {
namespace {

using Json = nlohmann::json;
using Names = std::vector<std::string>;

Outcome render(const std::string& scene, const TemporaryFolder& folder,
               std::vector<std::string> more = {}) {
    std::vector<std::string> all = {"render", scene,   "--size",
                                    "24x24",  "--out", folder.file("out")};
    if (!std::ranges::count(more, "--backend")) all.insert(all.end(), {"--backend", "cpu"});
    all.insert(all.end(), more.begin(), more.end());
    return run(all);
}

Json render_json(const std::string& scene, const TemporaryFolder& folder,
                 std::vector<std::string> more = {}) {
    more.insert(more.end(), {"--json", "-"});
    const Outcome outcome = render(scene, folder, more);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return Json::parse(outcome.out);
}

TEST(Render, WritesAnImagePerFrame) {
    TemporaryFolder folder;
    const Outcome outcome = render("builtin:cloth:500", folder, {"--frames", "0..2"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    EXPECT_EQ(folder.names(),
              (Names{"out", "out/frame_0000.png", "out/frame_0001.png", "out/frame_0002.png"}));
    EXPECT_EQ(lines(outcome.out).size(), 4u) << outcome.out;
}

TEST(Render, ListsOfFramesAreTheImagesOfTheirFrames) {
    TemporaryFolder list;
    EXPECT_EQ(render("builtin:orbits:500", list, {"--frames", "0..4:2,7,20.5"}).code, 0);
    EXPECT_EQ(list.names(),
              (Names{"out", "out/frame_0000.0.png", "out/frame_0002.0.png", "out/frame_0004.0.png",
                     "out/frame_0007.0.png", "out/frame_0020.5.png"}));
    // Frame 7 has left the bounds of the first frame.
    TemporaryFolder one;
    EXPECT_EQ(render("builtin:orbits:500", one, {"--frames", "7"}).code, 0);
    EXPECT_EQ(read_file(list.path() / "out/frame_0007.0.png"),
              read_file(one.path() / "out/frame_0007.png"));
}

TEST(Render, AllWholeFramesAreTheDefault) {
    TemporaryFolder folder;
    folder.write("s/f_3.obj", square_at(0));
    folder.write("s/f_4.obj", square_at(1));
    folder.write("s/f_5.obj", square_at(2));
    EXPECT_EQ(render(folder.file("s/f_%d.obj"), folder).code, 0);
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "out/frame_0002.png"));
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "out/frame_0003.png"));
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "out/frame_0005.png"));
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "out/frame_0006.png"));
}

TEST(Render, FramesBetweenWholeFramesAreInterpolated) {
    TemporaryFolder folder;
    folder.write("s/f_0.obj", square_at(0));
    folder.write("s/f_1.obj", square_at(10));
    const std::string halfway = folder.write("halfway.obj", square_at(5));
    // The same view of all: bounds, and with them camera, light and ground, differ.
    const Names view = {"--eye",   "5,0,20", "--target", "5,0,0",
                        "--light", "5,9,20", "--ground", "off"};
    const auto with = [&](Names more) {
        more.insert(more.end(), view.begin(), view.end());
        return more;
    };
    const Json between = render_json(folder.file("s"), folder, with({"--frames", "0..1:0.5"}));
    ASSERT_EQ(between["frames"].size(), 3u);
    EXPECT_EQ(between["frames"][1]["frame"], 0.5);
    EXPECT_EQ(between["frames"][1]["file"], "frame_0000.5.png");
    const Json expected = render_json(halfway, folder, with({}));
    EXPECT_EQ(between["frames"][1]["image_hash"], expected["frames"][0]["image_hash"]);
    EXPECT_NE(between["frames"][0]["image_hash"], expected["frames"][0]["image_hash"]);
}

TEST(Render, JsonHasTheMembersOfTheSchema) {
    TemporaryFolder folder;
    const Json json =
        render_json("builtin:cloth:500", folder, {"--frames", "0..1", "--rays", "ao"});
    EXPECT_EQ(json["schema"], "morphray/1");
    EXPECT_EQ(json["command"], "render");
    EXPECT_EQ(json["scene"], "cloth");
    EXPECT_EQ(json["backend"], "cpu");
    EXPECT_EQ(json["rays"], "ao");
    EXPECT_EQ(json["complete"], true);
    EXPECT_EQ(json["width"], 24);
    EXPECT_GT(json["triangles"], 100);
    EXPECT_TRUE(json["version"].is_string());
    ASSERT_EQ(json["frames"].size(), 2u);
    for (const Json& frame : json["frames"]) {
        for (const char* hash : {"hits_hash", "image_hash", "bvh_hash"}) {
            const std::string text = frame.at(hash);
            EXPECT_EQ(text.size(), 16u) << hash;
            EXPECT_EQ(text.find_first_not_of("0123456789abcdef"), std::string::npos) << text;
        }
        for (const char* number :
             {"frame", "deform_ms", "upload_ms", "refit_ms", "rebuild_ms", "trace_ms", "total_ms",
              "rays", "hits", "misses", "occluded", "sah_cost"}) {
            EXPECT_TRUE(frame.at(number).is_number()) << number;
            EXPECT_GE(frame.at(number), 0) << number;
        }
        EXPECT_EQ(frame["hits"].get<int>() + frame["misses"].get<int>(), 24 * 24);
        EXPECT_EQ(frame["rays"].get<int>(), 24 * 24 + 16 * frame["hits"].get<int>());
        EXPECT_LE(frame["occluded"].get<int>(), 16 * frame["hits"].get<int>());
    }
    EXPECT_EQ(json["frames"][0]["update"], "build");
    EXPECT_EQ(json["frames"][1]["update"], "refit");
    EXPECT_EQ(json["frames"][1]["refit_on"], "cpu");
}

TEST(Render, IsLitUnlessRaysAreGiven) {
    TemporaryFolder folder;
    const Json lit = render_json("builtin:cloth:500", folder, {"--frames", "3"});
    EXPECT_EQ(lit["shading"], "lit");
    EXPECT_EQ(lit["samples"], 4);
    EXPECT_EQ(lit["rays"], "shadow, ao");
    const Json& frame = lit["frames"][0];
    EXPECT_EQ(frame["hits"].get<int>() + frame["misses"].get<int>(), 4 * 24 * 24);
    const int hits = frame["hits"].get<int>();
    const int rays = 4 * 24 * 24 + 9 * hits;
    // Samples in shadow on smooth surfaces are asked again, by one ray or two.
    EXPECT_GT(frame["rays"].get<int>(), rays);
    EXPECT_LE(frame["rays"].get<int>(), rays + 2 * hits);
    const Json flat = render_json("builtin:cloth:500", folder, {"--frames", "3", "--flat"});
    EXPECT_EQ(flat["frames"][0]["rays"].get<int>(), rays);
    EXPECT_EQ(flat["frames"][0]["hits"], frame["hits"]);
    const Json plain =
        render_json("builtin:cloth:500", folder, {"--frames", "3", "--rays", "shadow"});
    EXPECT_EQ(plain["shading"], "plain");
    EXPECT_EQ(plain["samples"], 1);
    EXPECT_EQ(plain["rays"], "shadow");
    EXPECT_NE(plain["frames"][0]["image_hash"], frame["image_hash"]);
    const Json without =
        render_json("builtin:cloth:500", folder,
                    {"--frames", "3", "--ao-samples", "0", "--samples", "1", "--flat"});
    EXPECT_EQ(without["rays"], "shadow");
    EXPECT_EQ(without["frames"][0]["hits_hash"], plain["frames"][0]["hits_hash"]);
}

TEST(Render, LitImagesDoNotDependOnBackendTreeOrThreads) {
    TemporaryFolder folder;
    const auto hashes = [&](Names more) {
        more.insert(more.end(), {"--frames", "0..12:6", "--ground", "on"});
        std::string all;
        const Json json = render_json("builtin:cloth:900", folder, more);
        for (const Json& frame : json["frames"])
            all += frame["hits_hash"].get<std::string>() + frame["image_hash"].get<std::string>();
        return all;
    };
    const std::string expected = hashes({});
    EXPECT_EQ(hashes({"--update", "rebuild"}), expected);
    EXPECT_EQ(hashes({"--backend", "brute"}), expected);
#ifdef MORPHRAY_HAS_VULKAN
    EXPECT_EQ(hashes({"--backend", "vulkan"}), expected);
#endif
    EXPECT_EQ(hashes({"--build-at", "24", "--threads", "1"}), expected);
    EXPECT_EQ(hashes({"--threads", "7", "--simd", "off"}), expected);
    EXPECT_NE(hashes({"--flat"}), expected);
}

TEST(Render, FalseColoursAreOneImageEach) {
    TemporaryFolder folder;
    std::set<std::string> images;
    for (const char* shading : {"lit", "plain", "normal", "depth", "prim", "steps", "sah"}) {
        const Json json =
            render_json("builtin:cloth:500", folder, {"--frames", "3", "--shading", shading});
        EXPECT_EQ(json["shading"], shading);
        images.insert(json["frames"][0]["image_hash"].get<std::string>());
        const std::string png = read_file(folder.path() / "out/frame_0003.png");
        const bool has_scale = std::set<std::string>{"depth", "steps", "sah"}.contains(shading);
        EXPECT_EQ(png.find("Scale") != std::string::npos, has_scale) << shading;
    }
    EXPECT_EQ(images.size(), 7u);
}

TEST(Render, TheScaleOfDepthsIsThatOfTheBoundsBeforeTheEye) {
    const TemporaryFolder folder;
    const std::string scene = folder.write("t.obj", unit_triangle(4));
    const Names view = {"--shading", "depth", "--eye", "8,0,0", "--target", "0,0,0"};
    const std::string scale = "depths: 4 (white) to 8 (dark grey)";
    const Outcome outcome = render(scene, folder, view);
    EXPECT_EQ(outcome.err, "morphray: " + scale + '\n');
    EXPECT_NE(read_file(folder.path() / "out/frame_0000.png").find(scale), std::string::npos);
    Names quiet = view;
    quiet.emplace_back("-q");
    EXPECT_EQ(render(scene, folder, quiet).err, "");
}

TEST(Render, FilesStandOnAGroundUnlessItWouldHideThem) {
    // A triangle that stands on the ground; in the second frame it has fallen.
    TemporaryFolder folder;
    for (const int frame : {0, 1})
        folder.write(fmt::format("s/a_{}.obj", frame),
                     fmt::format("v 0 {0} 0\nv 1 {0} 0\nv 0 {1} 0\nf 1 2 3\n", -100 * frame,
                                 1 - 100 * frame));
    const std::string scene = folder.file("s");
    const auto frame = [&](int number, const std::string& of, Names more) {
        more.insert(more.end(), {"--samples", "1", "--frames", std::to_string(number)});
        return render_json(of, folder, more)["frames"][0];
    };
    const auto hash = [&](int number, const std::string& of, const Names& more) {
        return frame(number, of, more)["image_hash"].get<std::string>();
    };
    EXPECT_GT(frame(0, scene, {})["hits"], frame(0, scene, {"--ground", "off"})["hits"]);
    EXPECT_EQ(hash(0, scene, {}), hash(0, scene, {"--ground", "on"}));
    EXPECT_EQ(hash(0, "builtin:cloth:500", {}), hash(0, "builtin:cloth:500", {"--ground", "off"}));
    // From below, with files of data, and in other colours there is none.
    for (const Names& more : {Names{"--eye", "0.5,-9,3"}, Names{"--exr", "half"},
                              Names{"--hits", folder.file("h")}, Names{"--shading", "normal"}}) {
        Names off = more;
        off.insert(off.end(), {"--ground", "off"});
        EXPECT_EQ(hash(0, scene, more), hash(0, scene, off)) << more[0];
    }
    // The ground stays below a mesh that falls.
    const auto fallen = [&](const char* ground) {
        return frame(1, scene,
                     {"--eye", "0.5,-99,2", "--target", "0.5,-99.5,0", "--light", "0,-90,9",
                      "--shading", "prim", "--ground", ground});
    };
    EXPECT_GT(fallen("off")["hits"], 0);
    EXPECT_GT(fallen("on")["hits"], fallen("off")["hits"]);
}

TEST(Render, OutMayNameOneImage) {
    TemporaryFolder folder;
    const std::string file = folder.file("a/b.png");
    const auto to_file = [&](const char* frames) {
        return run({"render", "builtin:cloth:500", "--backend", "cpu", "--size", "24x24",
                    "--frames", frames, "--out", file});
    };
    EXPECT_EQ(to_file("3").code, 0);
    EXPECT_EQ(folder.names(), (Names{"a", "a/b.png"}));
    const Outcome several = to_file("3..4");
    EXPECT_EQ(several.code, 2);
    EXPECT_NE(several.err.find("one image, but 2 frames"), std::string::npos) << several.err;
}

TEST(Render, SourceOfColoursThatShowATreeIsTheirCommand) {
    for (const Names& tree : {Names{"--update", "refit"}, Names{"--update", "rebuild"},
                              Names{"--update", "refit", "--build-at", "3"}}) {
        const TemporaryFolder folder;
        Names more = {"--frames", "0..12:6", "--shading", "steps"};
        more.insert(more.end(), tree.begin(), tree.end());
        const Json json = render_json("builtin:cloth:900", folder, more);
        const Json& last = json["frames"].back();
        Names command = source_of(folder.path() / "out/frame_0012.png");
        command.insert(command.end(), {"--backend", "cpu", "--json", "-", "-o", folder.file("b")});
        const Outcome again = run(command);
        ASSERT_EQ(again.code, 0) << again.err;
        EXPECT_EQ(Json::parse(again.out)["frames"][0]["image_hash"], last["image_hash"]) << tree[1];
    }
}

TEST(Render, HitsFileMatchesItsHeader) {
    TemporaryFolder folder;
    const std::string scene = folder.write("t.obj", unit_triangle(4));
    const std::string file = folder.file("hits");
    const Outcome outcome = render(
        scene, folder, {"--eye", "1,1,3", "--target", "1,1,0", "--hits", file, "--rays", "ao"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const std::string bytes = read_file(file);
    ASSERT_EQ(bytes.size(), 20u + 24 * 24 * 20);
    EXPECT_EQ(bytes.substr(0, 8), std::string("MRHITS1\0", 8));
    std::uint32_t header[3];
    std::memcpy(header, bytes.data() + 8, sizeof(header));
    EXPECT_EQ(header[0], 24u);
    EXPECT_EQ(header[1], 24u);
    EXPECT_EQ(header[2], 1u);
    // The plane z = 0 is at depth 3 wherever it is seen.
    int hits = 0;
    for (int i = 0; i < 24 * 24; ++i) {
        struct {
            float t, u, v;
            std::uint32_t prim_id;
        } hit;
        std::memcpy(&hit, bytes.data() + 20 + 16 * i, sizeof(hit));
        if (hit.prim_id == 0xFFFFFFFF) continue;
        ++hits;
        EXPECT_EQ(hit.prim_id, 0u);
        EXPECT_NEAR(hit.t, 3, 1e-5);
        EXPECT_TRUE(hit.u >= 0 && hit.v >= 0 && hit.u + hit.v < 1.0001f);
    }
    EXPECT_GT(hits, 100);
}

TEST(Render, BadFrameInTheMiddleKeepsTheEarlierOnes) {
    TemporaryFolder folder;
    folder.write("s/f_0.obj", unit_triangle());
    folder.write("s/f_1.obj", unit_triangle());
    folder.write("s/f_2.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.write("s/f_3.obj", unit_triangle());
    const std::string json = folder.file("report.json");
    const Outcome outcome = render(folder.file("s"), folder, {"--json", json});
    EXPECT_EQ(outcome.code, 8) << outcome.err;
    const auto errors = lines(outcome.err);
    ASSERT_EQ(errors.size(), 1u) << outcome.err;
    EXPECT_EQ(errors[0].find("warning"), std::string::npos) << outcome.err;
    EXPECT_NE(errors.back().find("f_2.obj:2: "), std::string::npos) << outcome.err;
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "out/frame_0000.png"));
    EXPECT_TRUE(std::filesystem::exists(folder.path() / "out/frame_0001.png"));
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "out/frame_0002.png"));
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "out/frame_0003.png"));
    const Json report = Json::parse(read_file(json));
    EXPECT_EQ(report["complete"], false);
    EXPECT_EQ(report["frames"].size(), 2u);
}

TEST(Render, BadFrameThatIsNotSelectedIsNotRead) {
    TemporaryFolder folder;
    folder.write("s/f_0.obj", unit_triangle());
    folder.write("s/f_1.obj", unit_triangle());
    folder.write("s/f_2.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
    const std::string scene = folder.file("s");
    for (const Outcome& outcome :
         {render(scene, folder, {"--frames", "0..1"}), run({"info", scene})}) {
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        EXPECT_EQ(outcome.err, "");
    }
    // The error is about the frame that the tree is built at.
    const Outcome refused = render(scene, folder, {"--frames", "0..1", "--build-at", "2"});
    EXPECT_EQ(refused.code, 3);
    EXPECT_EQ(lines(refused.err).size(), 1u) << refused.err;
}

TEST(Render, ErrorsBeginWithTheirFile) {
    TemporaryFolder folder;
    folder.write("s/f_0.obj", unit_triangle());
    folder.write("s/f_2.obj", unit_triangle());
    folder.write("t/f_2.obj", "v 0 0 0\nv inf 0 0\nv 0 1 0\nf 1 2 3\n");
    const std::pair<std::string, std::string> endings[] = {
        {folder.file("s/f_*.obj"), "s/f_1.obj: frame is missing"},
        {folder.file("t/f_*.obj"), "t/f_2.obj:2: "}};
    for (const auto& [scene, place] : endings) {
        const Outcome outcome = render(scene, folder);
        EXPECT_EQ(outcome.code, 3) << outcome.err;
        EXPECT_TRUE(outcome.err.starts_with(folder.file(place))) << outcome.err;
    }
}

const std::string kPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
const std::string kObj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";

TEST(Render, PlyAndObjGiveTheSameImages) {
    const TemporaryFolder folder;
    std::string expected;
    for (const std::string scene : {folder.write("a.obj", kObj), folder.write("a.ply", kPly)}) {
        for (const char* backend : {"cpu", "brute"}) {
            const Outcome outcome = run({"render", scene, "--backend", backend, "--size", "32x32",
                                         "--out", folder.file("out"), "--json", "-"});
            ASSERT_EQ(outcome.code, 0) << outcome.err;
            const std::string hash = Json::parse(outcome.out)["frames"][0]["image_hash"];
            if (expected.empty()) expected = hash;
            EXPECT_EQ(hash, expected);
        }
    }
}

TEST(Render, FramesWithEqualNamesAreRefused) {
    TemporaryFolder folder;
    folder.write("s/f_0.obj", square_at(0));
    folder.write("s/f_1.obj", square_at(1));
    const Outcome outcome = render(folder.file("s"), folder, {"--frames", "0..0.00001:0.0000001"});
    EXPECT_EQ(outcome.code, 2) << outcome.err;
    EXPECT_NE(outcome.err.find("larger step"), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "out"));
}

}  // namespace
}  // namespace mray::test
