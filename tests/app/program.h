// Runs the built program as a user does: arguments in; exit code, stdout and stderr out.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"
#include "tests/support/text.h"

namespace mray::test {

using Words = std::vector<std::string>;

/// The words of a line, and more of them.
Words words(const std::string& line, const Words& more = {});

struct Outcome {
    /// The exit code, or 128 + the signal that ended it.
    int code = -1;
    std::string out;
    std::string err;
};

/// The environment of a run; each field is a deviation from the default.
struct Surroundings {
    std::string input = {};
    /// NAME=value, or NAME alone to remove it.
    Words environment = {};
    std::filesystem::path folder = {};
    /// The file that stdout is redirected to; empty to capture it.
    std::string stdout_to = {};
    bool stdout_closed = false;
    /// Whether stderr is a terminal of 100 columns, whose lines end in "\r\n".
    bool on_terminal = false;
};

/// Runs to the end; a run of more than 300 s is killed and fails the test.
Outcome run(const Words& arguments, const Surroundings& surroundings = {});

/// The report on stdout of a run that has to end with 0.
nlohmann::json json_of(const Outcome& outcome);

/// A run in progress.
class Started {
public:
    explicit Started(const Words& arguments, const Surroundings& surroundings = {});
    ~Started();
    Started(const Started&) = delete;
    Started& operator=(const Started&) = delete;

    void send(int signal);
    /// Reads until stdout or stderr has a match, and returns it. Fails the test after 300 s, or if
    /// the program ends before.
    std::string wait_for_out(const std::string& pattern) {
        return wait_for(out_, outcome_.out, pattern);
    }
    std::string wait_for_err(const std::string& pattern) {
        return wait_for(err_, outcome_.err, pattern);
    }
    Outcome wait();

private:
    std::string wait_for(int fd, std::string& text, const std::string& pattern);

    pid_t pid_ = -1;
    int out_ = -1;
    int err_ = -1;
    /// All that has been read so far.
    Outcome outcome_;
};

/// Lines of a text, without their ends.
Words lines(const std::string& text);

/// The words of the command in a PNG file's text Source, without the program's name.
Words source_of(const std::filesystem::path& png);

}  // namespace mray::test
