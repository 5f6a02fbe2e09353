#include "scenes/sequence/keyframe_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"
#include "scenes/mesh/mesh_file.h"

namespace mray {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kDigits = "0123456789";

struct NumberedName {
    std::string name;
    std::string prefix;
    std::string digits;
    std::string suffix;
    std::uint64_t number = 0;
};

[[noreturn]] void fail(const fs::path& path, const std::string& what, Hint hint = Hint::kNone) {
    throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", escape(path), what), hint);
}

void require_one_format(const fs::path& folder, const std::vector<NumberedName>& names) {
    const MeshFormat* const first = mesh_format_of(names[0].name);
    for (const NumberedName& name : names) {
        if (mesh_format_of(name.name) == first) continue;
        fail(folder, fmt::format("{} and {} have different formats, which one clip does not mix; "
                                 "give a pattern such as frame_%04d{}, or one file",
                                 escape(names[0].name), escape(name.name), first->extension));
    }
}

std::vector<std::string> file_names(const fs::path& folder) {
    std::vector<std::string> names;
    const std::error_code error = for_each_entry(folder, [&](const std::string& name) {
        std::error_code ignored;
        if (!fs::is_directory(folder / name, ignored)) names.push_back(name);
    });
    if (error) {
        fail(folder, fmt::format("folder cannot be read: {}; check the path", error.message()));
    }
    // A folder lists its files in an order of the file system.
    std::sort(names.begin(), names.end());
    return names;
}

NumberedName split_name(const fs::path& folder, const std::string& name) {
    const std::size_t stem = name.rfind('.');
    const std::size_t last = name.find_last_of(kDigits, stem);
    if (last == std::string::npos) return {name, name, "", "", 0};
    const std::size_t before = name.find_last_not_of(kDigits, last);
    const std::size_t first = before == std::string::npos ? 0 : before + 1;
    NumberedName result{name, name.substr(0, first), name.substr(first, last + 1 - first),
                        name.substr(last + 1), 0};
    if (result.digits.size() > 18) {
        fail(folder, fmt::format("number of {} has more than 18 digits; rename it", escape(name)));
    }
    result.number = static_cast<std::uint64_t>(*parse_integer(result.digits));
    return result;
}

void require_alike(const fs::path& folder, const std::vector<NumberedName>& names) {
    for (std::size_t i = 1; i < names.size(); ++i) {
        const NumberedName& first = names[0];
        if (names[i].prefix == first.prefix && names[i].suffix == first.suffix &&
            !names[i].digits.empty() && !first.digits.empty()) {
            continue;
        }
        fail(folder, fmt::format("{} and {} are not frames of one sequence; give a pattern such "
                                 "as frame_%04d.obj, or one file",
                                 escape(first.name), escape(names[i].name)));
    }
}

/// The files in the order of their numbers; frames are `number` of each. Reports missing ones.
template <class Number>
std::vector<KeyframeFile> numbered_files(const fs::path& folder, std::vector<NumberedName> names,
                                         std::uint64_t step, const ClipOptions& options,
                                         const Number& number) {
    std::vector<KeyframeFile> files;
    std::string first_missing;
    for (std::size_t i = 0; i < names.size(); ++i) {
        files.push_back({static_cast<double>(number(names[i])), folder / names[i].name});
        if (i == 0) continue;
        const NumberedName& before = names[i - 1];
        if (names[i].number == before.number) {
            fail(folder, fmt::format("{} and {} are the same frame; remove one",
                                     escape(before.name), escape(names[i].name)));
        }
        if (first_missing.empty() && names[i].number - before.number > step) {
            first_missing = fmt::format("{}{:0{}}{}", before.prefix, before.number + step,
                                        before.digits.size(), before.suffix);
        }
    }
    if (first_missing.empty()) return files;
    const double missing =
        files.back().frame - files.front().frame + 1 - static_cast<double>(files.size());
    const std::string more = missing > 1 ? fmt::format(" and {} more", missing - 1) : "";
    if (options.missing == MissingFrames::kFail) {
        fail(folder / first_missing, fmt::format("frame is missing{}; add it", more),
             Hint::kReplaceMissing);
    }
    if (options.warn) {
        options.warn(
            {escape(folder / first_missing), fmt::format("frame is missing{}; {}", more,
                                                         options.missing == MissingFrames::kHold
                                                             ? "the frame before is held"
                                                             : "its neighbours are interpolated")});
    }
    return files;
}

void sort_by_number(std::vector<NumberedName>& names) {
    std::stable_sort(names.begin(), names.end(), [](const NumberedName& a, const NumberedName& b) {
        return a.number < b.number;
    });
}

[[noreturn]] void refuse(const std::string& pattern, const char* what) {
    throw Error(ErrorKind::kBadArgument,
                fmt::format("pattern {}: {}; write one %d, %0Nd (N from 1 to 9) or * in the file "
                            "name, and %% for a percent sign",
                            quote(pattern), what));
}

/// A pattern with a place for a number of at least `width` digits; 0: of any width.
struct NamePattern {
    std::string folder;
    std::string prefix;
    std::string suffix;
    std::size_t width = 0;

    std::optional<NumberedName> match(const std::string& name) const {
        constexpr std::size_t kMostDigits = 9;
        if (name.size() <= prefix.size() + suffix.size() || !name.starts_with(prefix) ||
            !name.ends_with(suffix)) {
            return std::nullopt;
        }
        const std::string digits =
            name.substr(prefix.size(), name.size() - prefix.size() - suffix.size());
        if (digits.size() > kMostDigits || digits.find_first_not_of(kDigits) != std::string::npos) {
            return std::nullopt;
        }
        const auto number = static_cast<std::uint64_t>(*parse_integer(digits));
        if (width > 0 && fmt::format("{:0{}}", number, width) != digits) return std::nullopt;
        return NumberedName{name, prefix, digits, suffix, number};
    }
};

NamePattern read_pattern(const std::string& pattern) {
    NamePattern result;
    const bool is_glob = pattern.find('*') != std::string::npos;
    const std::size_t name_at = pattern.rfind('/') + 1;  // npos + 1 is 0
    std::string text;
    bool numbered = false;
    for (std::size_t i = 0; i < pattern.size(); ++i) {
        if (i == name_at) result.folder = std::exchange(text, {});
        if (pattern[i] != (is_glob ? '*' : '%')) {
            text += pattern[i];
            continue;
        }
        const std::string_view rest = std::string_view(pattern).substr(i + 1);
        if (!is_glob && rest.starts_with('%')) {
            text += '%';
            ++i;
            continue;
        }
        const bool padded = rest.size() >= 3 && rest[0] == '0' && rest[1] >= '1' &&
                            rest[1] <= '9' && rest[2] == 'd';
        if (!is_glob && !padded && !rest.starts_with('d')) refuse(pattern, "unknown use of '%'");
        if (i < name_at) refuse(pattern, "frame number in a folder's name");
        if (numbered) refuse(pattern, "two frame numbers");
        numbered = true;
        result.prefix = std::exchange(text, {});
        if (is_glob) continue;
        result.width = padded ? static_cast<std::size_t>(rest[1] - '0') : 1;
        i += padded ? 3 : 1;
    }
    result.suffix = text;
    if (!numbered) refuse(pattern, "no frame number");
    return result;
}

}  // namespace

std::vector<KeyframeFile> files_of_folder(const fs::path& folder, const ClipOptions& options) {
    std::vector<NumberedName> names;
    for (const std::string& name : file_names(folder)) {
        if (name[0] != '.' && mesh_format_of(name) != nullptr)
            names.push_back(split_name(folder, name));
    }
    if (names.empty()) {
        fail(folder,
             fmt::format("no {} file in this folder; check the path", extensions_of_meshes()));
    }
    require_one_format(folder, names);
    sort_by_number(names);
    require_alike(folder, names);
    const std::uint64_t first = names[0].number;
    std::uint64_t step = 0;
    for (const NumberedName& name : names) step = std::gcd(step, name.number - first);
    return numbered_files(folder, names, step, options, [&](const NumberedName& name) {
        return step == 0 ? 0 : (name.number - first) / step;
    });
}

std::vector<KeyframeFile> files_of_pattern(const std::string& text, const ClipOptions& options) {
    const NamePattern pattern = read_pattern(text);
    std::vector<NumberedName> names;
    for (const std::string& name : file_names(pattern.folder.empty() ? "." : pattern.folder)) {
        if (auto match = pattern.match(name)) names.push_back(std::move(*match));
    }
    if (names.empty()) fail(text, "no file matches this pattern; check the path");
    sort_by_number(names);
    return numbered_files(pattern.folder, names, 1, options,
                          [](const NumberedName& name) { return name.number; });
}

}  // namespace mray
