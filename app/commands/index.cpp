// morphray index: writes the index of a clip, or compares it with the clip's files.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "app/clip/frames.h"
#include "app/commands/commands.h"
#include "clips/index/index_file.h"
#include "common/base/errors.h"
#include "common/base/output_file.h"
#include "common/text/message_text.h"

namespace mray::app {
namespace {

std::filesystem::path index_path(const Options& options) {
    if (!options.out.empty()) return options.out;
    return default_index_path(options.scene, options.cache);
}

/// Refuses to write over a file that is no index: a frame, for example.
void require_index_or_nothing(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::exists(path, error) || is_index_file(path)) return;
    throw Error(ErrorKind::kOutput,
                fmt::format("{}: exists, and is not an index; choose another name", shown(path)));
}

/// Reads the whole clip.
ClipIndex make_index(const Options& options, const Messages& messages) {
    const std::shared_ptr<const ClipIndex> index = open_clip(options, messages)->make_index();
    if (index == nullptr) {
        throw Error(ErrorKind::kBadInput,
                    fmt::format("{}: has no frames in files of their own or in a point cache, so "
                                "that an index would be of no use",
                                shown(options.scene)));
    }
    return *index;
}

std::string frames_text(std::size_t count) {
    return fmt::format("{} frame{}", count, count == 1 ? "" : "s");
}

/// Returns the differences between an index and the clip, a line each.
std::vector<std::string> differences(const ClipIndex& index, const ClipIndex& clip) {
    std::vector<std::string> lines;
    if (index.topology_hash != clip.topology_hash || index.vertex_count != clip.vertex_count)
        lines.emplace_back("other triangles");
    const std::size_t files = std::min(index.files.size(), clip.files.size());
    for (std::size_t i = 0; i < files; ++i) {
        const IndexedFile& a = index.files[i];
        const IndexedFile& b = clip.files[i];
        if (a.name != b.name) {
            lines.push_back(fmt::format("{} instead of {}", shown(b.name), shown(a.name)));
        } else if (a.size != b.size || a.hash != b.hash) {
            lines.push_back(fmt::format("{}: other content", shown(b.name)));
        } else if (a.modified_ns != b.modified_ns) {
            lines.push_back(
                fmt::format("{}: another time of change, with the same content", shown(b.name)));
        }
    }
    if (index.files.size() != clip.files.size()) {
        lines.push_back(
            fmt::format("{} files instead of {}", clip.files.size(), index.files.size()));
    }
    if (index.facts.bounds.size() != clip.facts.bounds.size()) {
        lines.push_back(fmt::format("{} instead of {}", frames_text(clip.facts.bounds.size()),
                                    index.facts.bounds.size()));
    } else if (lines.empty() && (index.facts.bounds != clip.facts.bounds ||
                                 index.facts.damaged != clip.facts.damaged)) {
        lines.emplace_back("other bounds or damage of frames");
    }
    return lines;
}

ExitCode verify(const Options& options, const Messages& messages) {
    const std::filesystem::path path = index_path(options);
    const ClipIndex index = read_index_file(path);
    const ClipIndex clip = make_index(options, messages);
    const std::vector<std::string> lines = differences(index, clip);
    if (lines.empty()) {
        messages.print(fmt::format("{}: is right for {}\n", shown(path),
                                   frames_text(clip.facts.bounds.size())));
        return ExitCode::kOk;
    }
    std::string text;
    for (const std::string& line : lines) text += fmt::format("{}: {}\n", shown(path), line);
    messages.print(text);
    return ExitCode::kCheckFailed;
}

}  // namespace

ExitCode run_index(const Options& options, const Messages& messages) {
    if (options.verifies) return verify(options, messages);
    const std::filesystem::path path = index_path(options);
    check_writable(path);
    require_index_or_nothing(path);
    const ClipIndex index = make_index(options, messages);
    write_file(path, encode_index(index));
    const std::string damaged =
        index.facts.damaged.empty()
            ? std::string()
            : fmt::format(", {} of them damaged", index.facts.damaged.size());
    messages.print(fmt::format("{}: {} of {} vertices{}\n", shown(path),
                               frames_text(index.facts.bounds.size()), index.vertex_count,
                               damaged));
    return ExitCode::kOk;
}

}  // namespace mray::app
