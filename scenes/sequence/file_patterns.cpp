#include "scenes/sequence/file_patterns.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "common/text/text.h"

namespace mray {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kDigits = "0123456789";
constexpr std::size_t kMostDigits = 18;

/// The names of a sequence: a number between two texts.
struct Pattern {
    std::string prefix;
    std::string suffix = {};
};

struct NumberedName {
    std::string name;
    std::size_t digits = 0;
    std::uint64_t number = 0;
};

[[noreturn]] void fail_at(const fs::path& path, const std::string& what, Hint hint = Hint::kNone) {
    throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", escape(path), what), hint);
}

std::vector<std::string> file_names(const fs::path& folder) {
    std::vector<std::string> names;
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
        std::error_code ignored;
        if (!entry->is_directory(ignored)) names.push_back(entry->path().filename().native());
    }
    if (error == std::errc::not_enough_memory) throw std::bad_alloc();
    if (error)
        fail_at(folder, fmt::format("folder cannot be read: {}; check the path", error.message()));
    // A folder lists its files in an order of the file system.
    std::sort(names.begin(), names.end());
    return names;
}

/// The pattern of a name, by the last number before its ending; a name without one is all prefix.
Pattern pattern_of(const std::string& name) {
    const std::size_t last = name.find_last_of(kDigits, name.rfind('.'));
    if (last == std::string::npos) return {name};
    const std::size_t before = name.find_last_not_of(kDigits, last);
    return {name.substr(0, before + 1), name.substr(last + 1)};  // npos + 1 is 0
}

/// Nothing for a name that does not match.
std::optional<NumberedName> numbered(const std::string& name, const Pattern& pattern) {
    const std::size_t around = pattern.prefix.size() + pattern.suffix.size();
    if (name.size() <= around || name.size() - around > kMostDigits ||
        !name.starts_with(pattern.prefix) || !name.ends_with(pattern.suffix))
        return std::nullopt;
    const std::string digits = name.substr(pattern.prefix.size(), name.size() - around);
    const auto number = parse_unsigned(digits);
    return number ? std::optional(NumberedName{name, digits.size(), *number}) : std::nullopt;
}

/// Number `first` is frame 0, and the next frame is `step` numbers on. Reports missing ones.
std::vector<KeyframeFile> numbered_files(const fs::path& folder, const Pattern& pattern,
                                         const std::vector<NumberedName>& names,
                                         std::uint64_t first, std::uint64_t step,
                                         const AnimationOptions& options) {
    std::vector<KeyframeFile> files;
    std::string first_missing;
    for (std::size_t i = 0; i < names.size(); ++i) {
        files.push_back(
            {static_cast<double>((names[i].number - first) / step), folder / names[i].name});
        if (i == 0) continue;
        const NumberedName& before = names[i - 1];
        if (names[i].number == before.number) {
            fail_at(folder, fmt::format("{} and {} are the same frame; remove one",
                                        escape(before.name), escape(names[i].name)));
        }
        if (first_missing.empty() && names[i].number - before.number > step) {
            first_missing = fmt::format("{}{:0{}}{}", pattern.prefix, before.number + step,
                                        before.digits, pattern.suffix);
        }
    }
    if (first_missing.empty()) return files;
    const double missing =
        files.back().frame - files.front().frame + 1 - static_cast<double>(files.size());
    const std::string more = missing > 1 ? fmt::format(" and {} more", missing - 1) : "";
    if (!options.skip_missing) {
        fail_at(folder / first_missing, fmt::format("frame is missing{}; add it", more),
                Hint::kReplaceMissing);
    }
    if (options.warn) {
        options.warn({escape(folder / first_missing),
                      fmt::format("frame is missing{}; its neighbours are interpolated", more)});
    }
    return files;
}

[[noreturn]] void refuse_pattern(const std::string& pattern, const char* what) {
    throw Error(ErrorKind::kBadArgument,
                "pattern {}: {}; write one %d, %0Nd (N from 1 to 9) or * in the file name",
                quote(pattern), what);
}

Pattern split_pattern(const std::string& pattern) {
    const std::size_t name_at = pattern.rfind('/') + 1;  // npos + 1 is 0
    const std::size_t mark = pattern.find_first_of("%*", name_at);
    if (mark == std::string::npos) refuse_pattern(pattern, "no frame number in the file's name");
    std::size_t end = mark + 1;
    if (pattern[mark] == '%') {
        const std::string_view rest = std::string_view(pattern).substr(end);
        const bool is_padded = rest.size() >= 3 && rest[0] == '0' && rest[1] >= '1' &&
                               rest[1] <= '9' && rest[2] == 'd';
        if (!is_padded && !rest.starts_with('d')) refuse_pattern(pattern, "unknown use of '%'");
        end += is_padded ? 3 : 1;
    }
    if (pattern.find_first_of("%*", end) != std::string::npos)
        refuse_pattern(pattern, "two frame numbers");
    return {pattern.substr(name_at, mark - name_at), pattern.substr(end)};
}

}  // namespace

bool has_mesh_name(const std::filesystem::path& path) {
    const std::string extension = lower_case(path.extension().native());
    return extension == ".obj" || extension == ".ply";
}

std::vector<KeyframeFile> files_of_folder(const fs::path& folder, const AnimationOptions& options,
                                          const std::string& prefix, const std::string& suffix) {
    std::vector<std::string> all = file_names(folder);
    std::erase_if(all, [&](const auto& name) {
        return name[0] == '.' || !has_mesh_name(name) || !name.starts_with(prefix) ||
               !name.ends_with(suffix);
    });
    if (all.empty())
        fail_at(folder / (prefix + '*' + suffix),
                "no .obj or .ply file of this name; check the path");
    const Pattern pattern = pattern_of(all[0]);
    std::vector<NumberedName> names;
    for (const std::string& name : all) {
        const std::optional<NumberedName> file = numbered(name, pattern);
        if (!file && name != all[0]) {
            fail_at(folder, fmt::format("{} and {} are not frames of one sequence; give a pattern "
                                        "such as frame_%04d.obj, or one file",
                                        escape(all[0]), escape(name)));
        }
        names.push_back(file.value_or(NumberedName{name}));
    }
    std::ranges::stable_sort(names, {}, &NumberedName::number);
    const std::uint64_t first = names[0].number;
    std::uint64_t step = 0;
    for (const NumberedName& name : names) step = std::gcd(step, name.number - first);
    return numbered_files(folder, pattern, names, first, std::max<std::uint64_t>(step, 1), options);
}

std::vector<KeyframeFile> files_of_pattern(const std::string& text,
                                           const AnimationOptions& options) {
    const Pattern pattern = split_pattern(text);
    const fs::path folder = fs::path(text).parent_path();
    std::vector<NumberedName> names;
    for (const std::string& name : file_names(folder.empty() ? "." : folder))
        if (const auto file = numbered(name, pattern)) names.push_back(*file);
    // A star also stands for more than a number, as in *.obj.
    if (names.empty() && text.ends_with('*' + pattern.suffix))
        return files_of_folder(folder.empty() ? "." : folder, options, pattern.prefix,
                               pattern.suffix);
    if (names.empty()) fail_at(text, "no file matches this pattern; check the path");
    std::ranges::stable_sort(names, {}, &NumberedName::number);
    return numbered_files(folder, pattern, names, 0, 1, options);
}

}  // namespace mray
