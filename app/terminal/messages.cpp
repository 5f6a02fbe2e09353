#include "app/terminal/messages.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <mutex>

#include "app/base/remedy_text.h"
#include "app/terminal/progress.h"
#include "common/base/output_file.h"
#include "common/text/message_text.h"

namespace mray::app {
namespace {

constexpr const char* kStdout = "/dev/stdout";

/// Whether a file is named up to a colon, such as a texture that a scene has.
bool begins_with_file(std::string_view message) {
    for (std::size_t colon = message.find(':'); colon != std::string_view::npos;
         colon = message.find(':', colon + 1)) {
        std::error_code error;
        if (std::filesystem::is_regular_file(message.substr(0, colon), error)) return true;
    }
    return false;
}

void write_line(const char* prefix, std::string_view message) {
    const ProgressPause pause;
    const std::string line = prefix + shown(std::string(message)) + '\n';
    std::string_view rest = line;
    while (!rest.empty()) {
        const ssize_t written = ::write(STDERR_FILENO, rest.data(), rest.size());
        if (written <= 0) return;
        rest.remove_prefix(static_cast<std::size_t>(written));
    }
}

}  // namespace

Messages::Messages(const Options& options) : quiet_(options.quiet), verbose_(options.verbose) {
    std::vector<std::string> names = options.scenes;
    names.insert(names.end(), options.compared_files.begin(), options.compared_files.end());
    names.insert(names.end(), {options.scene, options.out, options.json, options.csv, options.junit,
                               options.hits, options.ray_file, options.point_file, options.plot,
                               options.html, options.screenshot, options.baseline, options.cache});
    for (const std::string& name : names) {
        if (name.empty() || name == "-" || name.starts_with("builtin:")) continue;
        // The files of a sequence begin like its pattern.
        const std::size_t number = name.find_first_of("%*");
        files_.push_back({shown(name.substr(0, number)), number != std::string::npos});
    }
}

bool Messages::names_file(std::string_view message) const {
    const bool is_named = std::any_of(files_.begin(), files_.end(), [&](const NamedFile& file) {
        if (file.name.empty() || !message.starts_with(file.name)) return false;
        // A word of a message may begin like a file or folder.
        const std::string_view rest = message.substr(file.name.size());
        return file.is_pattern || file.name.ends_with('/') || rest.starts_with(':') ||
               rest.starts_with('/');
    });
    return is_named || begins_with_file(message);
}

void Messages::error(std::string_view message) const {
    write_line(names_file(message) ? "" : "morphray: ", message);
}

void Messages::error(const Error& error) const { this->error(message_of(error)); }

void Messages::warn(const Warning& warning) const {
    static std::mutex mutex;
    const std::scoped_lock lock(mutex);
    warnings_.push_back(warning.line(remedy_text(warning.remedy)));
    write_line(warning.place.empty() ? "morphray: " : "", warnings_.back());
}

void Messages::note(std::string_view message) const {
    if (verbose_) write_line("morphray: ", message);
}

void Messages::print(std::string_view text) const {
    if (quiet_ || text.empty()) return;
    const ProgressPause pause;
    write_file(kStdout, text);
}

void write_report(const std::string& file, std::string_view text) {
    write_file(file == "-" ? kStdout : file, text);
}

void check_reports(std::initializer_list<std::string> files) {
    for (const std::string& file : files) {
        if (!file.empty() && file != "-") check_writable(file);
    }
}

bool is_stdout(std::string_view file) { return file == "-" || file == kStdout; }

bool takes_stdout(std::initializer_list<std::string> files) {
    return std::any_of(files.begin(), files.end(), is_stdout);
}

}  // namespace mray::app
