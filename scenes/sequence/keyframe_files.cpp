#include "scenes/sequence/keyframe_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <string_view>
#include <system_error>

#include "common/base/errors.h"
#include "common/base/folder_entries.h"
#include "common/text/message_text.h"
#include "common/text/number_text.h"
#include "scenes/mesh_files/mesh_file.h"
#include "scenes/sequence/frame_pattern.h"

namespace mray {
namespace {

namespace fs = std::filesystem;

struct NumberedName {
    std::string name;
    std::string prefix;
    std::string digits;
    std::string suffix;
    std::uint64_t number = 0;
};

[[noreturn]] void fail(const fs::path& path, const std::string& what,
                       Remedy remedy = Remedy::kNone) {
    throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", shown(path), what), remedy);
}

bool is_mesh_name(const std::string& name, const ClipOptions& options) {
    return name[0] != '.' && mesh_format_of(name, options.more_formats) != nullptr;
}

void require_one_format(const fs::path& folder, const std::vector<NumberedName>& names,
                        const ClipOptions& options) {
    const auto format = [&](const NumberedName& name) {
        return mesh_format_of(name.name, options.more_formats);
    };
    for (const NumberedName& name : names) {
        if (format(name) == format(names[0])) continue;
        fail(folder,
             fmt::format("{} and {} have different formats, which one clip does not mix; "
                         "give a pattern such as frame_%04d{}, or one file",
                         shown(names[0].name), shown(name.name), format(names[0])->extension));
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
    constexpr std::string_view kDigits = "0123456789";
    const std::size_t stem = name.rfind('.');
    const std::size_t last = name.find_last_of(kDigits, stem);
    if (last == std::string::npos) return {name, name, "", "", 0};
    const std::size_t before = name.find_last_not_of(kDigits, last);
    const std::size_t first = before == std::string::npos ? 0 : before + 1;
    NumberedName result{name, name.substr(0, first), name.substr(first, last + 1 - first),
                        name.substr(last + 1), 0};
    if (result.digits.size() > 18) {
        fail(folder, fmt::format("number of {} has more than 18 digits; rename it", shown(name)));
    }
    result.number = static_cast<std::uint64_t>(*parse_integer(result.digits));
    return result;
}

void require_alike(const fs::path& folder, const std::vector<NumberedName>& names) {
    for (std::size_t i = 1; i < names.size(); ++i) {
        if (names[i].prefix != names[0].prefix || names[i].suffix != names[0].suffix ||
            names[i].digits.empty() || names[0].digits.empty()) {
            fail(folder,
                 fmt::format("{} and {} are not frames of one sequence; give a pattern such "
                             "as frame_%04d.obj, or one file",
                             shown(names[0].name), shown(names[i].name)));
        }
    }
    for (std::size_t i = 1; i < names.size(); ++i) {
        if (names[i].number == names[i - 1].number) {
            fail(folder, fmt::format("{} and {} are the same frame; remove one",
                                     shown(names[i - 1].name), shown(names[i].name)));
        }
    }
}

// One message for all missing files, with the name of the first.
void report_missing(const fs::path& folder, const std::string& first, std::uint64_t count,
                    const ClipOptions& options) {
    const std::string more = count > 1 ? fmt::format(" and {} more", count - 1) : "";
    if (options.missing == MissingFrames::kFail) {
        fail(folder / first, fmt::format("frame is missing{}; add it", more),
             Remedy::kReplaceMissing);
    }
    if (options.warn) {
        options.warn({shown(folder / first), fmt::format("frame is missing{}; {}", more,
                                                         options.missing == MissingFrames::kHold
                                                             ? "the frame before is held"
                                                             : "its neighbours are interpolated")});
    }
}

}  // namespace

std::vector<KeyframeFile> files_of_folder(const fs::path& folder, const ClipOptions& options) {
    std::vector<NumberedName> names;
    for (const std::string& name : file_names(folder)) {
        if (is_mesh_name(name, options)) names.push_back(split_name(folder, name));
    }
    if (names.empty()) {
        fail(folder, fmt::format("no {} file in this folder; check the path",
                                 extensions_of_meshes(options.more_formats)));
    }
    require_one_format(folder, names, options);
    std::stable_sort(names.begin(), names.end(), [](const NumberedName& a, const NumberedName& b) {
        return a.number < b.number;
    });
    require_alike(folder, names);

    std::uint64_t step = 0;
    for (std::size_t i = 1; i < names.size(); ++i) {
        step = std::gcd(step, names[i].number - names[i - 1].number);
    }
    std::vector<KeyframeFile> files;
    std::string first_missing;
    for (std::size_t i = 0; i < names.size(); ++i) {
        const std::uint64_t offset = names[i].number - names[0].number;
        const std::uint64_t frame = step == 0 ? 0 : offset / step;
        files.push_back({static_cast<double>(frame), folder / names[i].name});
        if (i > 0 && first_missing.empty() && names[i].number - names[i - 1].number > step) {
            first_missing = fmt::format("{}{:0{}}{}", names[i].prefix, names[i - 1].number + step,
                                        names[i - 1].digits.size(), names[i].suffix);
        }
    }
    const auto missing =
        static_cast<std::uint64_t>(files.back().frame) + 1 - std::uint64_t{files.size()};
    if (missing > 0) report_missing(folder, first_missing, missing, options);
    return files;
}

std::vector<KeyframeFile> files_of_pattern(const std::string& text, const ClipOptions& options) {
    const FramePattern pattern(text);
    const fs::path folder = pattern.folder().empty() ? "." : pattern.folder();
    std::vector<std::uint64_t> numbers;
    for (const std::string& name : file_names(folder)) {
        if (const auto number = pattern.number_of(name)) numbers.push_back(*number);
    }
    if (numbers.empty()) fail(text, "no file matches this pattern; check the path");
    std::sort(numbers.begin(), numbers.end());

    std::vector<KeyframeFile> files;
    files.reserve(numbers.size());
    for (const std::uint64_t number : numbers) {
        files.push_back(
            {static_cast<double>(number), fs::path(pattern.folder()) / pattern.file_name(number)});
    }
    const std::uint64_t missing = numbers.back() - numbers.front() + 1 - numbers.size();
    if (missing > 0) {
        const auto gap = std::adjacent_find(numbers.begin(), numbers.end(),
                                            [](auto a, auto b) { return b != a + 1; });
        report_missing(pattern.folder(), pattern.file_name(*gap + 1), missing, options);
    }
    return files;
}

std::vector<KeyframeFile> files_of_glob(const std::string& glob, const ClipOptions& options) {
    const std::size_t star = glob.find('*');
    const std::size_t name_at = glob.rfind('/') + 1;  // npos + 1 is 0
    if (star == std::string::npos || star < name_at ||
        glob.find('*', star + 1) != std::string::npos) {
        throw Error(ErrorKind::kBadArgument,
                    fmt::format("pattern {}: write one * for the frame number, in the file name",
                                in_quotes(glob)));
    }
    const fs::path parent = glob.substr(0, name_at);
    const fs::path folder = parent.empty() ? "." : parent;
    const std::string prefix = glob.substr(name_at, star - name_at);
    const std::string suffix = glob.substr(star + 1);
    std::vector<NumberedName> names;
    for (const std::string& name : file_names(folder)) {
        if (name.size() <= prefix.size() + suffix.size() || !name.starts_with(prefix) ||
            !name.ends_with(suffix)) {
            continue;
        }
        const std::string digits =
            name.substr(prefix.size(), name.size() - prefix.size() - suffix.size());
        constexpr std::size_t kMostDigits = 9;
        const bool is_number = digits.find_first_not_of("0123456789") == std::string::npos;
        if (!is_number || digits.size() > kMostDigits) continue;
        const auto number = static_cast<std::uint64_t>(*parse_integer(digits));
        names.push_back({name, prefix, digits, suffix, number});
    }
    if (names.empty()) fail(glob, "no file matches this pattern; check the path");
    std::stable_sort(names.begin(), names.end(), [](const NumberedName& a, const NumberedName& b) {
        return a.number < b.number;
    });
    require_alike(folder, names);
    std::vector<KeyframeFile> files;
    std::string first_missing;
    for (std::size_t i = 0; i < names.size(); ++i) {
        files.push_back({static_cast<double>(names[i].number), parent / names[i].name});
        if (i > 0 && first_missing.empty() && names[i].number > names[i - 1].number + 1) {
            first_missing = fmt::format("{}{:0{}}{}", prefix, names[i - 1].number + 1,
                                        names[i - 1].digits.size(), suffix);
        }
    }
    const std::uint64_t missing = names.back().number - names.front().number + 1 - names.size();
    if (missing > 0) report_missing(parent, first_missing, missing, options);
    return files;
}

}  // namespace mray
