// morphray merge: checks the parts of a render that shards wrote, and puts their images together.
#include "app/commands/commands.h"
#include "app/commands/merge/merge_parts.h"
#include "app/farm/frame_tasks.h"
#include "app/files/png_reader.h"
#include "app/files/video/video.h"
#include "app/terminal/interrupt.h"
#include "common/base/output_file.h"
#include "tools/image/contact_sheet.h"

namespace mray::app {
namespace {

void write_sheet(const std::string& file, const std::vector<MergedFrame>& frames) {
    std::vector<Image> thumbnails;
    for (std::size_t i = 0; i < frames.size(); i += sheet_step(frames.size())) {
        throw_if_interrupted();
        const Image image = read_png(frames[i].file);
        thumbnails.push_back(contact_sheet({&image, 1}, thumbnail_width(frames.size())));
    }
    write_file(file, encode_png(contact_sheet(thumbnails)));
}

std::vector<std::filesystem::path> files_of(const std::vector<MergedFrame>& frames) {
    std::vector<std::filesystem::path> files;
    for (const MergedFrame& frame : frames) files.push_back(frame.file);
    return files;
}

}  // namespace

ExitCode run_merge(const Options& options, const Messages& messages) {
    check_reports({options.json, options.sheet});
    if (!options.video.empty()) check_video(options.video);
    const MergeReport report = check_parts(read_parts(options.part_folders));
    if (report.is_right() && !report.frames.empty()) {
        if (!options.sheet.empty()) write_sheet(options.sheet, report.frames);
        if (!options.video.empty())
            write_video(options.video, options.video_rate, files_of(report.frames));
    } else if (!options.sheet.empty() || !options.video.empty()) {
        messages.warn({{}, "neither sheet nor video is written: not all frames are right"});
    }
    if (!options.json.empty()) write_report(options.json, to_json(report));
    if (!takes_stdout({options.json})) messages.print(to_text(report));
    return report.is_right() ? ExitCode::kOk : ExitCode::kCheckFailed;
}

}  // namespace mray::app
