#include "clips/obj/texture_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/text/message_text.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"

namespace mray {
namespace {

// Options with one value that do not concern bilinear filtering, and with values that change
// colours or coordinates.
constexpr std::array<std::string_view, 4> kHarmless = {"-blendu", "-blendv", "-texres", "-boost"};
constexpr std::array<std::string_view, 4> kOneValue = {"-bm", "-imfchan", "-type", "-cc"};

bool is_one_of(std::string_view word, const std::array<std::string_view, 4>& words) {
    return std::find(words.begin(), words.end(), word) != words.end();
}

class MapParser {
public:
    explicit MapParser(std::string_view text) : rest_(trimmed(text, kMtlBlanks)) {}

    ParsedMap run() {
        while (rest_.starts_with('-') && result_.problem.empty()) {
            const std::string_view option = first_word();
            // A file name may begin with a dash.
            if (!read_option(option)) break;
        }
        std::string_view name = rest_;
        if (name.size() > 1 && name.front() == '"' && name.back() == '"')
            name = name.substr(1, name.size() - 2);
        result_.map.file = name;
        std::replace(result_.map.file.begin(), result_.map.file.end(), '\\', '/');
        if (result_.problem.empty() && name.empty()) result_.problem = "names no file";
        return std::move(result_);
    }

private:
    std::string_view first_word() const { return rest_.substr(0, rest_.find_first_of(kMtlBlanks)); }

    std::string_view take_word() {
        const std::string_view word = first_word();
        rest_ = trimmed(rest_.substr(word.size()), kMtlBlanks);
        return word;
    }

    /// Returns false, and takes nothing, if there is no such option.
    bool read_option(std::string_view option) {
        if (option == "-clamp") {
            take_word();
            const std::string_view value = take_word();
            if (value != "on" && value != "off") fail(option, value, "on or off");
            result_.map.clamp = value == "on";
        } else if (option == "-s") {
            read_numbers(result_.map.scale);
        } else if (option == "-o") {
            read_numbers(result_.map.offset);
        } else if (option == "-t") {
            std::array<float, 2> turbulence = {0, 0};
            read_numbers(turbulence);
            if (turbulence != std::array<float, 2>{0, 0}) ignore(option);
        } else if (option == "-mm") {
            take_word();
            const std::optional<float> base = parse_float(take_word());
            const std::optional<float> gain = parse_float(take_word());
            if (!base || !gain) fail(option, {}, "two numbers");
            if (base != 0.0f || gain != 1.0f) ignore(option);
        } else if (is_one_of(option, kHarmless)) {
            take_word();
            take_word();
        } else if (is_one_of(option, kOneValue)) {
            take_word();
            if (take_word() != "off") ignore(option);
        } else {
            return false;
        }
        return true;
    }

    /// Takes an option and one to three numbers for u, v and w.
    void read_numbers(std::array<float, 2>& numbers) {
        const std::string option(take_word());
        for (std::size_t i = 0; i < 3; ++i) {
            const std::string_view word = first_word();
            const std::optional<float> number = parse_float(word);
            // The last word is the file.
            if (i > 0 && (!number || word.size() == rest_.size())) return;
            if (!number || !std::isfinite(*number)) return fail(option, word, "a finite number");
            if (i < numbers.size()) numbers[i] = *number;
            take_word();
        }
    }

    void fail(std::string_view option, std::string_view value, std::string_view wanted) {
        if (!result_.problem.empty()) return;
        result_.problem = value.empty() ? fmt::format("has {} without {}", option, wanted)
                                        : fmt::format("has {} {}, which is not {}", option,
                                                      in_quotes(value), wanted);
    }

    void ignore(std::string_view option) {
        if (result_.ignored.empty()) result_.ignored = std::string(option);
    }

    std::string_view rest_;
    ParsedMap result_;
};

}  // namespace

ParsedMap parse_texture_map(std::string_view arguments) { return MapParser(arguments).run(); }

}  // namespace mray
