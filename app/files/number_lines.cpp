#include "app/files/number_lines.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>
#include <system_error>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/message_text.h"
#include "common/text/number_text.h"

namespace mray::app {
namespace {

constexpr std::string_view kBlank = " \t\r";

}  // namespace

void NumberLines::fail(const std::string& what) const {
    throw Error(ErrorKind::kBadInput,
                fmt::format("{}:{}: {}; write `{}`", name_, line_, what, form_));
}

std::size_t NumberLines::next(std::span<double> numbers) {
    while (!rest_.empty()) {
        ++line_;
        const std::size_t end = std::min(rest_.find('\n'), rest_.size());
        std::string_view line = rest_.substr(0, end);
        rest_.remove_prefix(std::min(end + 1, rest_.size()));
        line = line.substr(0, line.find('#'));
        std::size_t count = 0;
        for (;;) {
            line.remove_prefix(std::min(line.find_first_not_of(kBlank), line.size()));
            if (line.empty()) break;
            const std::string_view word = line.substr(0, line.find_first_of(kBlank));
            line.remove_prefix(word.size());
            const std::optional<float> number = parse_float(word);
            if (!number) fail(in_quotes(word) + " is not a number");
            if (count == numbers.size()) fail(fmt::format("more than {} numbers", numbers.size()));
            numbers[count++] = *number;
        }
        if (count > 0) return count;
    }
    return 0;
}

std::uint64_t count_lines(std::string_view text) {
    const auto ends = static_cast<std::uint64_t>(std::ranges::count(text, '\n'));
    return ends + (text.empty() || text.ends_with('\n') ? 0 : 1);
}

std::string read_input(const std::string& file, const char* content) {
    if (file != "-") return read_input_file(file);
    std::string text;
    std::array<char, 1 << 16> buffer;
    for (;;) {
        const ssize_t got = ::read(STDIN_FILENO, buffer.data(), buffer.size());
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) {
            throw Error(ErrorKind::kBadInput,
                        fmt::format("<stdin>: cannot be read ({}); give a file of {}",
                                    std::generic_category().message(errno), content));
        }
        if (got == 0) return text;
        text.append(buffer.data(), static_cast<std::size_t>(got));
        if (text.size() > kMaxInputBytes) {
            throw Error(ErrorKind::kLimit,
                        fmt::format("<stdin>: more than 4 GiB of {}; give them in parts", content));
        }
    }
}

std::string input_name(const std::string& file) { return file == "-" ? "<stdin>" : file; }

}  // namespace mray::app
