#include "app/cli/output_conflicts.h"

#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "app/terminal/messages.h"
#include "common/base/errors.h"
#include "common/text/message_text.h"

namespace mray::app {
namespace {

namespace fs = std::filesystem;

/// The file of an option.
struct NamedFile {
    const char* option;
    fs::path given;
    /// The same for all names of one file.
    fs::path file;
};

fs::path real_path(const fs::path& path) {
    std::error_code error;
    const fs::path found = fs::weakly_canonical(fs::absolute(path, error), error);
    return error ? path : found;
}

/// Adds the file, unless there is none, or it is a device, a pipe, stdout or a folder.
void add_file(std::vector<NamedFile>& files, const char* option, const fs::path& path) {
    const std::string& name = path.native();
    if (name.empty() || is_stdout(name) || name.ends_with('/') || name.starts_with("/dev/") ||
        name.starts_with("/proc/"))
        return;
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (fs::exists(status) && !fs::is_regular_file(status)) return;
    files.push_back({option, path, real_path(path)});
}

std::vector<NamedFile> outputs_of(const Options& options) {
    std::vector<NamedFile> files;
    const bool is_render = options.command == Command::kRender;
    if (options.command == Command::kTrace || options.command == Command::kQuery ||
        (is_render && renders_one_image(options)))
        add_file(files, "--out", options.out);
    if (is_render && renders_one_image(options) && !options.shading.exr.empty())
        add_file(files, "--exr", fs::path(options.out).replace_extension(".exr"));
    for (const auto& [option, file] :
         {std::pair("--json", &options.json), std::pair("--junit", &options.junit),
          std::pair("--html", &options.html), std::pair("--csv", &options.csv),
          std::pair("--hits", &options.hits), std::pair("--plot", &options.plot),
          std::pair("--screenshot", &options.screenshot)})
        add_file(files, option, *file);
    return files;
}

std::vector<NamedFile> inputs_of(const Options& options) {
    std::vector<NamedFile> files;
    add_file(files, "the scene", options.scene);
    for (const std::string& scene : options.scenes) add_file(files, "the scene", scene);
    for (const std::string& file : options.compared_files) add_file(files, "the file", file);
    for (const auto& [option, file] :
         {std::pair("--cache", &options.cache), std::pair("--rays", &options.ray_file),
          std::pair("--points", &options.point_file), std::pair("--baseline", &options.baseline)})
        add_file(files, option, *file);
    return files;
}

/// Whether render gives files in its folder such names.
bool is_name_of_images(const fs::path& file) {
    const std::string name = file.filename();
    const auto is_like = [&name](std::string_view begin, std::string_view end) {
        return name.starts_with(begin) && name.ends_with(end);
    };
    return is_like("frame_", ".png") || is_like("frame_", ".exr") || is_like("frame_", ".hits");
}

/// The folders with such files.
std::vector<std::string> image_folders(const Options& options) {
    std::vector<std::string> folders;
    if (options.command != Command::kRender) return folders;
    if (!renders_one_image(options)) folders.push_back(options.out.empty() ? "out" : options.out);
    if (options.hits.ends_with('/')) folders.push_back(options.hits);
    return folders;
}

[[noreturn]] void refuse_output(const std::string& message) {
    throw Error(ErrorKind::kBadArgument, message);
}

}  // namespace

void check_output_conflicts(const Options& options) {
    const std::vector<NamedFile> outputs = outputs_of(options);
    const std::vector<NamedFile> inputs = inputs_of(options);
    for (std::size_t i = 0; i < outputs.size(); ++i) {
        const NamedFile& output = outputs[i];
        for (std::size_t other = 0; other < i; ++other) {
            if (outputs[other].file == output.file)
                refuse_output(fmt::format("{}, {}: both would be written to {}; give two names",
                                          outputs[other].option, output.option,
                                          shown(output.given)));
        }
        for (const NamedFile& input : inputs) {
            const bool replaces = input.option == std::string_view("--baseline") &&
                                  output.option == std::string_view("--json");
            if (input.file == output.file && !replaces)
                refuse_output(fmt::format("{}: {} is read, as {}; give another name", output.option,
                                          shown(output.given), input.option));
        }
        for (const std::string& folder : image_folders(options)) {
            // With a name behind it, a folder is the same with and without a slash at its end.
            if (real_path(fs::path(folder) / output.file.filename()) == output.file &&
                is_name_of_images(output.file))
                refuse_output(fmt::format("{}: {} is a name of images and parts; give another name",
                                          output.option, shown(output.given)));
        }
    }
}

}  // namespace mray::app
