#include "app/terminal/messages.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include "app/cli/remedy_text.h"
#include "common/base/output_file.h"
#include "common/text/message_text.h"

namespace morphray::app {
namespace {

constexpr const char* kStdout = "/dev/stdout";

void write_line(const char* prefix, std::string_view message) {
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
    for (const std::string& name : {options.scene, options.out, options.json, options.csv,
                                    options.junit, options.hits, options.ray_file}) {
        // The files of a sequence begin like its pattern.
        const std::string file = shown(name.substr(0, name.find('%')));
        if (file.empty() || file == "-" || file.starts_with("builtin:")) continue;
        files_.push_back(file);
    }
}

bool Messages::names_file(std::string_view message) const {
    return std::any_of(files_.begin(), files_.end(),
                       [&](const std::string& file) { return message.starts_with(file); });
}

void Messages::error(std::string_view message) const {
    write_line(names_file(message) ? "" : "morphray: ", message);
}

void Messages::error(const Error& error) const { this->error(message_of(error)); }

void Messages::warn(const Warning& warning) const {
    write_line(warning.place.empty() ? "morphray: " : "",
               warning.line(remedy_text(warning.remedy)));
}

void Messages::note(std::string_view message) const {
    if (verbose_) write_line("morphray: ", message);
}

void Messages::print(std::string_view text) const {
    if (!quiet_ && !text.empty()) write_file(kStdout, text);
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

}  // namespace morphray::app
