#include "clips/index/index_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "clips/source/open_scene.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/thrown_error.h"

namespace mray {
namespace {

using namespace test;

std::string triangle_at(int x) {
    return fmt::format("v {:04} 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", x);
}

/// A sequence of ten files with its index.
class IndexedSequence {
public:
    static constexpr int kFrames = 10;

    explicit IndexedSequence(int bad_frame = -1) {
        for (int i = 0; i < kFrames; ++i) {
            folder_.write(fmt::format("clip/f_{}.obj", i),
                          i == bad_frame ? "v 1 2\n" : triangle_at(i));
        }
        write_index();
    }

    void write_index(const ClipOptions& options = {}) {
        const std::vector<std::byte> bytes = encode_index(*open_without(options)->make_index());
        folder_.write("clip.mrindex", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    }
    std::unique_ptr<Clip> open_without(ClipOptions options = {}) {
        options.takes_index = false;
        return open(options);
    }
    std::unique_ptr<Clip> open(ClipOptions options = {}) {
        warnings_.clear();
        options.warn = [this](const Warning& warning) { warnings_.push_back(warning.line()); };
        return open_scene(scene(), options);
    }
    std::string scene() const { return folder_.file("clip"); }
    std::filesystem::path file(int frame) const {
        return folder_.file(fmt::format("clip/f_{}.obj", frame));
    }
    std::filesystem::path index() const { return folder_.file("clip.mrindex"); }

    /// Changes a file without a trace in its size and time.
    void replace_secretly(int frame, const std::string& text) {
        const auto time = std::filesystem::last_write_time(file(frame));
        ASSERT_EQ(text.size(), std::filesystem::file_size(file(frame)));
        folder_.write(fmt::format("clip/f_{}.obj", frame), text);
        std::filesystem::last_write_time(file(frame), time);
    }
    void write(const std::string& name, const std::string& text) { folder_.write(name, text); }
    const std::vector<std::string>& warnings() const { return warnings_; }

private:
    TemporaryFolder folder_;
    std::vector<std::string> warnings_;
};

float x_at(const Clip& clip, double frame) {
    std::vector<vec3> positions(clip.topology().vertex_count);
    clip.positions(frame, positions);
    return positions[0].x;
}

/// Expects a warning that says `what`, and the clip as without an index.
void expect_stale(IndexedSequence& sequence, const std::string& what,
                  const ClipOptions& options = {}) {
    const std::unique_ptr<Clip> clip = sequence.open(options);
    EXPECT_EQ(clip->index_use().state, IndexUse::State::kStale);
    ASSERT_EQ(sequence.warnings().size(), 1u);
    const std::string& warning = sequence.warnings()[0];
    EXPECT_TRUE(warning.starts_with(sequence.index().native() + ": warning: the index is not used"))
        << warning;
    EXPECT_NE(warning.find(what), warning.npos) << warning;
    const std::unique_ptr<Clip> expected = sequence.open_without(options);
    for (int axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(clip->bounds().lower[axis], expected->bounds().lower[axis]);
        EXPECT_EQ(clip->bounds().upper[axis], expected->bounds().upper[axis]);
    }
}

TEST(IndexFile, LiesBesideTheClip) {
    const TemporaryFolder folder;
    const std::string clip = folder.file("clip");
    folder.write("clip/f_1.obj", "");
    EXPECT_EQ(default_index_path(clip, ""), clip + ".mrindex");
    EXPECT_EQ(default_index_path(clip + "//", ""), clip + ".mrindex");
    EXPECT_EQ(default_index_path(clip + "/.", ""), clip + ".mrindex");
    EXPECT_EQ(default_index_path(clip + "/f_%04d.obj", ""), clip + "/f_#.obj.mrindex");
    EXPECT_EQ(default_index_path(clip + "/f_*.obj", ""), clip + "/f_#.obj.mrindex");
    EXPECT_EQ(default_index_path("mesh.obj", "a/cloth.pc2"), "a/cloth.pc2.mrindex");
}

TEST(IndexFile, GivesBoundsWithoutReadingTheFiles) {
    IndexedSequence sequence;
    // Opening the file would fail.
    sequence.replace_secretly(5, std::string(triangle_at(5).size(), 'x'));
    const std::unique_ptr<Clip> clip = sequence.open();
    EXPECT_TRUE(sequence.warnings().empty());
    EXPECT_EQ(clip->index_use().state, IndexUse::State::kUsed);
    EXPECT_EQ(clip->index_use().file, sequence.index().native());
    EXPECT_EQ(clip->bounds().upper[0], 9);
    for (const int frame : {0, 1, 4, 6, 9}) EXPECT_EQ(x_at(*clip, frame), float(frame));
    EXPECT_EQ(x_at(*clip, 7.5), 7.5f);
    EXPECT_EQ(kind_of([&] { x_at(*clip, 4.5); }), ErrorKind::kBadInput);
}

TEST(IndexFile, IsStaleWhenAFileHasAnotherTime) {
    IndexedSequence sequence;
    const auto time = std::filesystem::last_write_time(sequence.file(3));
    std::filesystem::last_write_time(sequence.file(3), time + std::chrono::nanoseconds(1));
    expect_stale(sequence, "f_3.obj has changed since");
}

TEST(IndexFile, IsStaleWhenAFileHasAnotherSize) {
    IndexedSequence sequence;
    const auto time = std::filesystem::last_write_time(sequence.file(3));
    sequence.write("clip/f_3.obj", triangle_at(3) + "#");
    std::filesystem::last_write_time(sequence.file(3), time);
    expect_stale(sequence, "f_3.obj has changed since");
}

TEST(IndexFile, IsStaleWhenAFileIsNew) {
    IndexedSequence sequence;
    sequence.write("clip/f_10.obj", triangle_at(20));
    expect_stale(sequence, "is of 10 frames in 10 files, not of 11 in 11");
}

TEST(IndexFile, IsStaleWhenFilesHaveOtherNames) {
    IndexedSequence sequence;
    for (int i = 0; i < IndexedSequence::kFrames; ++i)
        std::filesystem::rename(sequence.file(i), sequence.scene() + fmt::format("/g_{}.obj", i));
    expect_stale(sequence, "f_0.obj");
}

TEST(IndexFile, IsStaleForOtherTriangles) {
    IndexedSequence sequence;
    for (int i = 0; i < IndexedSequence::kFrames; ++i)
        sequence.replace_secretly(i, fmt::format("v {:04} 0 0\nv 1 0 0\nv 0 1 0\nf 1 3 2\n", i));
    expect_stale(sequence, "is of other triangles");
}

TEST(IndexFile, IsStaleWhenItIsDamagedOrNone) {
    for (const std::string& bytes :
         {std::string(), std::string("MRINDEX\n"), std::string(99, 'x'), std::string(9999, '\0')}) {
        IndexedSequence sequence;
        sequence.write("clip.mrindex", bytes);
        expect_stale(sequence, "it is ");
    }
}

TEST(IndexFile, IsStaleWhenItIsAFolder) {
    IndexedSequence sequence;
    std::filesystem::remove(sequence.index());
    std::filesystem::create_directory(sequence.index());
    expect_stale(sequence, "is a folder");
}

TEST(IndexFile, OfDamagedFramesServesTheSameStrictnessOnly) {
    IndexedSequence sequence;
    sequence.write("clip/f_4.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    sequence.write_index();
    const std::unique_ptr<Clip> clip = sequence.open();
    EXPECT_EQ(clip->index_use().state, IndexUse::State::kUsed);
    ASSERT_TRUE(clip->damage());
    EXPECT_TRUE(clip->damage()->text.starts_with("frame 4: ")) << clip->damage()->text;
    EXPECT_FALSE(clip->usable(4));
    EXPECT_FALSE(clip->usable(3.5));
    EXPECT_TRUE(clip->usable(5));
    const std::string expected = message_of([&] { x_at(*sequence.open_without(), 4); });
    EXPECT_EQ(message_of([&] { x_at(*clip, 4); }), expected);
    EXPECT_EQ(sequence.open({.lenient = true})->index_use().state, IndexUse::State::kStale);
    sequence.write_index({.lenient = true});
    EXPECT_EQ(sequence.open({.lenient = true})->index_use().state, IndexUse::State::kUsed);
    // The warning is told again.
    ASSERT_EQ(sequence.warnings().size(), 1u);
    EXPECT_EQ(sequence.open()->index_use().state, IndexUse::State::kStale);
}

TEST(IndexFile, WithOtherBoundsThanAFrameIsAnErrorOfThatFrame) {
    for (const int x : {50, 7, -99}) {
        IndexedSequence sequence;
        sequence.replace_secretly(5, triangle_at(x));
        const std::unique_ptr<Clip> clip = sequence.open();
        EXPECT_EQ(x_at(*clip, 4), 4.0f);
        for (const double frame : {4.5, 5.0, 5.25}) {
            const std::string error = message_of([&] { x_at(*clip, frame); });
            EXPECT_TRUE(
                error.starts_with(sequence.index().native() + ": tells otherwise of frame 5 than "))
                << error;
        }
        EXPECT_EQ(x_at(*clip, 6), 6.0f);
    }
}

TEST(IndexFile, WithOtherBoundsThanTheFirstFrameIsStale) {
    IndexedSequence sequence;
    sequence.replace_secretly(0, triangle_at(3));
    expect_stale(sequence, "it tells otherwise of the first frame");
}

TEST(IndexFile, ThatIsNamedMustBeThere) {
    IndexedSequence sequence;
    const std::string other = sequence.scene() + "/nothing";
    EXPECT_EQ(kind_of([&] { sequence.open({.index = other}); }), ErrorKind::kBadInput);
    const std::string moved = sequence.scene() + "/moved";
    std::filesystem::rename(sequence.index(), moved);
    EXPECT_EQ(sequence.open()->index_use().state, IndexUse::State::kAbsent);
    EXPECT_EQ(sequence.open({.index = moved})->index_use().state, IndexUse::State::kUsed);
}

TEST(IndexFile, IsForClipsOfSeveralFrames) {
    const TemporaryFolder folder;
    const std::string one = folder.write("one.obj", triangle_at(1)).native();
    EXPECT_EQ(open_scene(one)->make_index(), nullptr);
    EXPECT_EQ(open_scene("builtin:cloth:300")->make_index(), nullptr);
    EXPECT_EQ(open_scene(one)->index_use().state, IndexUse::State::kNone);
}

TEST(GivenBounds, TakeThePlaceOfReadingAllFrames) {
    IndexedSequence sequence;
    sequence.replace_secretly(5, std::string(triangle_at(5).size(), 'x'));
    const std::unique_ptr<Clip> clip = sequence.open({.bounds = WorldBounds{{0, 0, 0}, {8, 2, 0}}});
    EXPECT_TRUE(sequence.warnings().empty());
    EXPECT_EQ(clip->index_use().state, IndexUse::State::kGiven);
    EXPECT_EQ(clip->bounds().upper[0], 8);
    EXPECT_EQ(x_at(*clip, 8), 8.0f);
    // The first file is read at once, but no frame needs it yet.
    sequence.write("clip/f_0.obj", triangle_at(50));
    const std::unique_ptr<Clip> later =
        sequence.open({.bounds = WorldBounds{{0, 0, 0}, {8, 2, 0}}});
    EXPECT_EQ(x_at(*later, 2), 2.0f);
    EXPECT_EQ(kind_of([&] { x_at(*later, 0); }), ErrorKind::kBadInput);
    EXPECT_EQ(kind_of([&] { x_at(*clip, 5); }), ErrorKind::kBadInput);
    const std::string error = message_of([&] { x_at(*clip, 8.5); });
    EXPECT_NE(error.find("f_9.obj: frame 9 reaches from 0 to 9 in x, beyond the bounds"),
              error.npos)
        << error;
}

TEST(GivenBounds, AreForFiles) {
    EXPECT_EQ(kind_of([] {
                  open_scene("builtin:cloth:300", {.bounds = WorldBounds{{0, 0, 0}, {1, 1, 1}}});
              }),
              ErrorKind::kBadArgument);
    EXPECT_EQ(kind_of([] { open_scene("builtin:cloth:300", {.index = "x"}); }),
              ErrorKind::kBadArgument);
}

}  // namespace
}  // namespace mray
