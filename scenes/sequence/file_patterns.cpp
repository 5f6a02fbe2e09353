#include "scenes/sequence/file_patterns.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
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

/// The names of files that match a pattern, by their numbers.
using NumberedNames = std::map<std::uint64_t, std::string>;

template <class... Values>
[[noreturn]] void fail_at(const fs::path& path, fmt::format_string<Values...> what,
                          Values&&... values) {
    throw Error(ErrorKind::kBadInput, "{}: {}", escape(path),
                fmt::format(what, std::forward<Values>(values)...));
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
    if (error) fail_at(folder, "folder cannot be read: {}; check the path", error.message());
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

/// Adds a name; returns false for one that does not match.
bool add_numbered(const fs::path& folder, const Pattern& pattern, const std::string& name,
                  NumberedNames& names) {
    const std::size_t around = pattern.prefix.size() + pattern.suffix.size();
    if (name.size() <= around || name.size() - around > kMostDigits ||
        !name.starts_with(pattern.prefix) || !name.ends_with(pattern.suffix))
        return false;
    const auto number =
        parse_unsigned(std::string_view(name).substr(pattern.prefix.size(), name.size() - around));
    if (!number) return false;
    const auto [known, is_new] = names.emplace(*number, name);
    if (is_new) return true;
    fail_at(folder, "{} and {} are the same frame; remove one", escape(known->second),
            escape(name));
}

/// Number `first` is frame 0, and the next frame is `step` numbers on. Reports missing ones.
std::vector<KeyframeFile> numbered_files(const fs::path& folder, const Pattern& pattern,
                                         const NumberedNames& names, std::uint64_t first,
                                         std::uint64_t step, const AnimationOptions& options) {
    std::vector<KeyframeFile> files;
    std::string first_missing;
    auto before = names.begin();
    for (auto at = names.begin(); at != names.end(); before = at++) {
        files.push_back({static_cast<double>((at->first - first) / step), folder / at->second});
        if (!first_missing.empty() || at->first - before->first <= step) continue;
        const std::size_t digits =
            before->second.size() - pattern.prefix.size() - pattern.suffix.size();
        first_missing =
            fmt::format("{}{:0{}}{}", pattern.prefix, before->first + step, digits, pattern.suffix);
    }
    if (first_missing.empty()) return files;
    const double missing =
        files.back().frame - files.front().frame + 1 - static_cast<double>(files.size());
    const std::string place = escape(folder / first_missing);
    const std::string what =
        "frame is missing" + (missing > 1 ? fmt::format(" and {} more", missing - 1) : "");
    if (!options.skip_missing) {
        throw Error(ErrorKind::kBadInput, fmt::format("{}: {}; add it", place, what),
                    Hint::kReplaceMissing);
    }
    if (options.warn) options.warn({place, what + "; its neighbours are interpolated"});
    return files;
}

Pattern split_pattern(const std::string& pattern) {
    const std::size_t name_at = pattern.rfind('/') + 1;  // npos + 1 is 0
    const std::size_t mark = std::min(pattern.find_first_of("%*", name_at), pattern.size());
    const std::string_view rest = std::string_view(pattern).substr(mark);
    const bool is_padded = rest.size() >= 4 && rest.starts_with("%0") && rest[2] >= '1' &&
                           rest[2] <= '9' && rest[3] == 'd';
    const std::size_t length = is_padded ? 4 : rest.starts_with("%d") ? 2 : rest.starts_with('*');
    if (length == 0 || rest.find_first_of("%*", length) != std::string_view::npos) {
        throw Error(ErrorKind::kBadArgument,
                    "pattern {}: write one %d, %0Nd (N from 1 to 9) or * in the file name",
                    quote(pattern));
    }
    return {pattern.substr(name_at, mark - name_at), std::string(rest.substr(length))};
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
    if (all.size() == 1) return {{0, folder / all[0]}};
    const Pattern pattern = pattern_of(all[0]);
    NumberedNames names;
    for (const std::string& name : all) {
        if (add_numbered(folder, pattern, name, names)) continue;
        fail_at(folder,
                "{} and {} are not frames of one sequence; give a pattern such as frame_%04d.obj, "
                "or one file",
                escape(all[0]), escape(name == all[0] ? all[1] : name));
    }
    const std::uint64_t first = names.begin()->first;
    std::uint64_t step = 0;
    for (const auto& [number, name] : names) step = std::gcd(step, number - first);
    return numbered_files(folder, pattern, names, first, step, options);
}

std::vector<KeyframeFile> files_of_pattern(const std::string& text,
                                           const AnimationOptions& options) {
    const Pattern pattern = split_pattern(text);
    fs::path folder = fs::path(text).parent_path();
    if (folder.empty()) folder = ".";
    NumberedNames names;
    for (const std::string& name : file_names(folder)) add_numbered(folder, pattern, name, names);
    // A star also stands for more than a number, as in *.obj.
    if (names.empty() && text.ends_with('*' + pattern.suffix))
        return files_of_folder(folder, options, pattern.prefix, pattern.suffix);
    if (names.empty()) fail_at(text, "no file matches this pattern; check the path");
    return numbered_files(folder, pattern, names, 0, 1, options);
}

}  // namespace mray
