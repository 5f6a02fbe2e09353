#include "common/base/input_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <new>
#include <system_error>

#include "common/base/errors.h"
#include "common/text/text.h"

namespace mray {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
    throw Error(ErrorKind::kBadInput, "{}: {}", escape(path), what);
}

std::string why_not_opened(int error) {
    switch (error) {
        case ENOENT:
        case ENOTDIR:
            return "no such file; check the path";
        case EACCES:
        case EPERM:
            return "may not be read; check its permissions";
        case ENOMEM:
            throw std::bad_alloc();
        default:
            return fmt::format("cannot be opened: {}; check the path",
                               std::generic_category().message(error));
    }
}

[[noreturn]] void fail_not_regular(const fs::path& path) {
    fail(path, "is a pipe or device; give a file, or - for stdin where FILE|- is possible");
}

}  // namespace

std::string read_input_file(const fs::path& path, std::uint64_t max_bytes) {
    const InputFile file(path);
    if (file.size() > max_bytes) {
        throw Error(ErrorKind::kLimit,
                    "{}: {} bytes are more than the {} that are read; split the scene",
                    escape(path), file.size(), max_bytes);
    }
    std::string bytes(file.size(), '\0');
    file.read(0, std::as_writable_bytes(std::span(bytes)));
    return bytes;
}

// O_NONBLOCK: opening a pipe without a writer returns at once; a regular file ignores it.
InputFile::InputFile(const fs::path& path)
    : path_(path), fd_(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC)) {
    // A socket answers ENXIO.
    if (fd_ < 0 && errno == ENXIO) fail_not_regular(path);
    if (fd_ < 0) fail(path, why_not_opened(errno));
    struct stat status = {};
    ::fstat(fd_, &status);
    if (S_ISREG(status.st_mode)) {
        size_ = static_cast<std::uint64_t>(status.st_size);
        return;
    }
    ::close(fd_);
    if (S_ISDIR(status.st_mode)) fail(path, "is a folder; give a file");
    fail_not_regular(path);
}

InputFile::~InputFile() { ::close(fd_); }

void InputFile::read(std::uint64_t offset, std::span<std::byte> out) const {
    while (!out.empty()) {
        // Linux reads at most 2 GiB less a page a call.
        const std::size_t most = std::min<std::size_t>(out.size(), 1u << 30);
        const ssize_t count = ::pread(fd_, out.data(), most, static_cast<off_t>(offset));
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) {
            fail(path_, fmt::format("cannot be read: {}; check the disk",
                                    std::generic_category().message(errno)));
        }
        if (count == 0) fail(path_, "changed while it was read; wait until it is complete");
        out = out.subspan(static_cast<std::size_t>(count));
        offset += static_cast<std::uint64_t>(count);
    }
}

fs::path side_file(const fs::path& scene_file, const std::string& name) {
    if (name.size() >= PATH_MAX) {
        fail(scene_file, fmt::format("names {}, a name of {} bytes, which no file can have",
                                     quote(name), name.size()));
    }
    const fs::path given(name);
    if (given.is_absolute() || name.find('\0') != std::string::npos) {
        fail(scene_file, fmt::format("names {} by an absolute path, which is not followed; put the "
                                     "file beside the scene and give its name only",
                                     quote(name)));
    }
    std::error_code error;
    const fs::path parent = scene_file.has_parent_path() ? scene_file.parent_path() : ".";
    const fs::path folder = fs::canonical(parent, error);
    if (error) fail(parent, why_not_opened(error.value()));
    fs::path real = fs::canonical(folder / given, error);
    const auto [folder_end, inside] =
        std::mismatch(folder.begin(), folder.end(), real.begin(), real.end());
    // A missing file gives the same error wherever it would lie, so that nothing else is revealed.
    const bool leaves = std::find(given.begin(), given.end(), "..") != given.end();
    if (leaves || (!error && folder_end != folder.end())) {
        fail(scene_file, fmt::format("names {}, which lies outside of the scene's folder and is "
                                     "not followed; put the file beside the scene",
                                     quote(name)));
    }
    if (error) fail(folder / given, why_not_opened(error.value()));
    return real;
}

}  // namespace mray
