#include "app/terminal/messages.h"

#include <unistd.h>

#include <algorithm>
#include <mutex>

#include "app/terminal/failure.h"
#include "app/terminal/progress.h"
#include "common/base/output_file.h"
#include "common/text/text_parts.h"

namespace mray::app {
namespace {

constexpr const char* kStdout = "/dev/stdout";
constexpr const char* kProgram = "morphray: ";

void write_line(const char* prefix, std::string_view message) {
    const ProgressPause pause;
    const std::string line = prefix + escape(std::string(message)) + '\n';
    std::string_view rest = line;
    while (!rest.empty()) {
        const ssize_t written = ::write(STDERR_FILENO, rest.data(), rest.size());
        if (written <= 0) return;
        rest.remove_prefix(static_cast<std::size_t>(written));
    }
}

}  // namespace

void Messages::error(const Failure& failure) const {
    const bool begins_with_file =
        failure.code == ExitCode::kBadInput || failure.code == ExitCode::kOutput;
    write_line(begins_with_file ? "" : kProgram, failure.message);
}

void Messages::error(const Error& error) const {
    this->error(Failure{message_of(error), exit_code_of(error.kind())});
}

void Messages::warn(const Warning& warning) const {
    static std::mutex mutex;
    const std::scoped_lock lock(mutex);
    warnings_.push_back(warning.line(hint_text(warning.hint)));
    write_line(warning.place.empty() ? kProgram : "", warnings_.back());
}

void Messages::note(std::string_view message) const {
    if (verbose_) write_line(kProgram, message);
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
