// Numbers of a text, line by line, and the text itself from a file or stdin.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace mray::app {

/// Reads the lines of a text that have numbers. Numbers are rounded to float, like vertices, so
/// that a float printed with 9 digits is read back exactly; inf and nan are numbers. '#' begins a
/// comment; lines without numbers are skipped.
class NumberLines {
public:
    /// `name` is the file in messages, `form` what a line should be. All views must outlive the
    /// reader.
    NumberLines(std::string_view name, std::string_view text, std::string_view form)
        : name_(name), rest_(text), form_(form) {}

    /// Reads the next line into `numbers`. Returns how many it has; 0 at the end. Throws
    /// Error(kBadInput) for what is not a number, and for more numbers than there is room for.
    std::size_t next(std::span<double> numbers);
    /// Throws Error(kBadInput) that names the file and the line that was read last.
    [[noreturn]] void fail(const std::string& what) const;
    /// The number of lines that were read.
    std::uint64_t line() const { return line_; }

private:
    std::string_view name_;
    std::string_view rest_;
    std::string_view form_;
    std::uint64_t line_ = 0;
};

/// The number of lines of a text.
std::uint64_t count_lines(std::string_view text);

/// The content of a file, or of stdin for "-"; `content` is "rays" or "points". Throws
/// Error(kBadInput), kLimit.
std::string read_input(const std::string& file, const char* content);
/// The file as messages name it: "<stdin>" for "-".
std::string input_name(const std::string& file);

}  // namespace mray::app
