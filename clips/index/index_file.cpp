#include "clips/index/index_file.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <system_error>
#include <utility>

#include "common/base/errors.h"
#include "common/base/hash.h"
#include "common/base/input_file.h"
#include "common/text/message_text.h"

namespace mray {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExtension = ".mrindex";
// An index of ten million keyframes has about a quarter of that.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;

struct Stamp {
    std::uint64_t size = 0;
    std::int64_t modified_ns = 0;
};

std::optional<Stamp> stamp_of(const fs::path& path) {
    struct stat status = {};
    if (stat(path.c_str(), &status) != 0) return std::nullopt;
    constexpr std::int64_t kSecond = 1'000'000'000;
    return Stamp{
        static_cast<std::uint64_t>(status.st_size),
        static_cast<std::int64_t>(status.st_mtim.tv_sec) * kSecond + status.st_mtim.tv_nsec};
}

std::uint64_t content_hash(const fs::path& path) {
    const InputFile file(path);
    std::vector<std::byte> buffer(std::min<std::uint64_t>(file.size(), std::uint64_t{1} << 20));
    Hasher hasher;
    for (std::uint64_t at = 0; at < file.size(); at += buffer.size()) {
        const std::span part(buffer.data(),
                             std::min<std::uint64_t>(buffer.size(), file.size() - at));
        file.read(at, part);
        hasher.add(std::span<const std::byte>(part));
    }
    return hasher.digest();
}

/// Why the index is not of the clip with these files; empty if it is.
std::string difference(const ClipIndex& index, const ClipOptions& options,
                       const IndexedClip& clip) {
    if (index.files.size() != clip.files.size() ||
        index.facts.bounds.size() != clip.keyframe_count) {
        return fmt::format("it is of {} frames in {} files, not of {} in {}",
                           index.facts.bounds.size(), index.files.size(), clip.keyframe_count,
                           clip.files.size());
    }
    if (index.topology_hash != clip.topology_hash || index.vertex_count != clip.vertex_count)
        return "it is of other triangles";
    const bool has_odd_frames = !index.facts.damaged.empty() || !index.facts.odd.empty();
    if (has_odd_frames &&
        (index.lenient != options.lenient || index.allow_empty != options.allow_empty))
        return "it is of a scene that was read more or less strictly";
    for (std::size_t i = 0; i < clip.files.size(); ++i) {
        const IndexedFile& file = index.files[i];
        const std::string name = clip.files[i].filename().native();
        if (file.name != name) return fmt::format("it has {}, not {}", in_quotes(file.name), name);
        const std::optional<Stamp> stamp = stamp_of(clip.files[i]);
        if (!stamp || stamp->size != file.size || stamp->modified_ns != file.modified_ns)
            return fmt::format("{} has changed since", shown(name));
    }
    if (clip.first_bounds && *clip.first_bounds != index.facts.bounds[0])
        return "it tells otherwise of the first frame";
    return {};
}

IndexUse stale(const fs::path& path, std::string reason) {
    return {IndexUse::State::kStale, path.native(), std::move(reason)};
}

}  // namespace

fs::path default_index_path(const std::string& scene, const std::string& cache) {
    std::string name = cache.empty() ? scene : cache;
    while (name.size() > 1 && name.ends_with('/')) name.pop_back();
    std::error_code error;
    if (!fs::exists(name, error)) {
        const std::size_t percent = name.find('%');
        const std::size_t end = name.find('d', std::min(percent, name.size()));
        if (end != std::string::npos) {
            name = name.substr(0, percent) + '#' + name.substr(end + 1);
        } else {
            std::replace(name.begin(), name.end(), '*', '#');
        }
    } else if (const fs::path last = fs::path(name).filename(); last == "." || last == "..") {
        const fs::path folder = fs::canonical(name, error);
        if (!error) name = folder.native();
    }
    return name + kExtension;
}

bool is_index_file(const fs::path& path) {
    try {
        const InputFile file(path);
        std::array<std::byte, kIndexMagic.size()> head = {};
        if (file.size() < head.size()) return false;
        file.read(0, head);
        return std::memcmp(head.data(), kIndexMagic.data(), head.size()) == 0;
    } catch (const Error&) {
        return false;
    }
}

ClipIndex read_index_file(const fs::path& path) {
    const std::string bytes = read_input_file(path, kMostBytes);
    try {
        return decode_index(std::as_bytes(std::span(bytes)));
    } catch (const Error& error) {
        throw Error(error.kind(), fmt::format("{}: {}", shown(path), error.what()));
    }
}

FoundIndex find_index(const std::string& scene, const ClipOptions& options,
                      const IndexedClip& clip) {
    const bool is_named = !options.index.empty();
    const fs::path path =
        is_named ? fs::path(options.index) : default_index_path(scene, options.cache);
    std::error_code none;
    if (!is_named && !fs::exists(path, none)) return {{IndexUse::State::kAbsent, path.native()}};
    std::string bytes;
    try {
        bytes = read_input_file(path, kMostBytes);
    } catch (const Error& error) {
        if (is_named) throw;
        return {stale(path, "it " + as_warning(error, shown(path)).text)};
    }
    try {
        ClipIndex index = decode_index(std::as_bytes(std::span(bytes)));
        const std::string differs = difference(index, options, clip);
        if (!differs.empty()) return {stale(path, differs)};
        return {{IndexUse::State::kUsed, path.native(), {}}, std::move(index)};
    } catch (const Error& error) {
        return {stale(path, std::string("it ") + error.what())};
    }
}

std::vector<IndexedFile> stamp_files(std::span<const fs::path> files) {
    std::vector<IndexedFile> stamped(files.size());
    tbb::parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) {
        const std::optional<Stamp> before = stamp_of(files[i]);
        const std::uint64_t hash = content_hash(files[i]);
        const std::optional<Stamp> after = stamp_of(files[i]);
        if (!before || !after || before->size != after->size ||
            before->modified_ns != after->modified_ns) {
            throw Error(ErrorKind::kBadInput,
                        fmt::format("{}: changed while it was read; wait until it is complete",
                                    shown(files[i])));
        }
        stamped[i] = {files[i].filename().native(), after->size, after->modified_ns, hash};
    });
    return stamped;
}

}  // namespace mray
