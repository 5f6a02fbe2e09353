// morphray diff: compares two files of hits, of other machines, devices or versions.
#include "app/commands/commands.h"
#include "report/compare.h"

namespace mray::app {
namespace {

// Images, and pixels of each, that are described.
constexpr std::size_t kShownImages = 8;
constexpr std::size_t kShownPixels = 3;

/// The hits as a frame whose pixels never differ.
Frame frame_of(const morphray::HitsFile& file, std::size_t image) {
    Frame frame;
    frame.width = file.width;
    frame.height = file.height;
    frame.pixels.assign(file.images[image].hits.size(), 0);
    for (const morphray::Hit& hit : file.images[image].hits)
        frame.hits.push_back({hit.t, hit.u, hit.v, hit.prim_id});
    const auto& occlusion = file.images[image].occlusion;
    frame.occlusion.assign(occlusion.begin(), occlusion.end());
    return frame;
}

std::string shape_of(const morphray::HitsFile& file) {
    return fmt::format("{} image{} of {}x{}", file.images.size(),
                       file.images.size() == 1 ? "" : "s", file.width, file.height);
}

std::string describe_hit(const Hit& hit, std::uint32_t occlusion) {
    return describe(hit) + (hit.prim_id == kNoPrim ? "" : fmt::format(" occluded {}", occlusion));
}

std::string describe_images(const std::vector<FrameDifference>& images) {
    std::string text;
    std::size_t shown_images = 0;
    for (std::size_t i = 0; i < images.size() && shown_images < kShownImages; ++i) {
        const FrameDifference& difference = images[i];
        if (difference.total() == 0) continue;
        ++shown_images;
        text += fmt::format("image {}: {}\n", i, describe(difference));
        for (std::size_t k = 0; k < std::min(difference.first.size(), kShownPixels); ++k) {
            const PixelDifference& p = difference.first[k];
            text += fmt::format("  pixel {},{}\n    expected {}\n    actual   {}\n", p.x, p.y,
                                describe_hit(p.expected, p.expected_occlusion),
                                describe_hit(p.actual, p.actual_occlusion));
        }
    }
    return text;
}

}  // namespace

ExitCode run_diff(const Options& options, const Messages& messages) {
    const std::vector<std::string>& names = options.inputs;
    const auto read = [](const std::string& name) {
        return call_library([&] { return morphray::read_hits(name); });
    };
    const morphray::HitsFile expected = read(names[0]);
    const morphray::HitsFile actual = read(names[1]);
    if (expected.width != actual.width || expected.height != actual.height ||
        expected.images.size() != actual.images.size())
        throw Error(ErrorKind::kBadInput,
                    "{}: has {}, but {} has {}; only files of the same size and number of images "
                    "can be compared",
                    escape(names[1]), shape_of(actual), escape(names[0]), shape_of(expected));
    std::vector<FrameDifference> images;
    for (std::size_t i = 0; i < expected.images.size(); ++i) {
        throw_if_interrupted();
        images.push_back(compare_frames(frame_of(expected, i), frame_of(actual, i)));
    }
    std::uint64_t pixels = 0;
    std::size_t differing = 0;
    for (const FrameDifference& difference : images) {
        pixels += difference.total();
        differing += difference.total() != 0;
    }
    std::string verdict = shape_of(actual) + ": equal bit by bit";
    if (pixels > 0)
        verdict = fmt::format("{}: {} pixel{} of {} image{} differ{}", shape_of(actual), pixels,
                              pixels == 1 ? "" : "s", differing, differing == 1 ? "" : "s",
                              pixels == 1 ? "s" : "");
    return write_reports(
        pixels == 0 ? ExitCode::kOk : ExitCode::kCheckFailed, messages, {},
        [&] { return describe_images(images) + verdict + '\n'; }, verdict);
}

}  // namespace mray::app
