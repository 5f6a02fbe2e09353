#include "common/base/input_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstring>
#include <system_error>

#include "common/base/errors.h"
#include "common/base/file_descriptor.h"
#include "common/text/text_parts.h"

namespace mray {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
    throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", escape(path), what));
}

std::string why_not_opened(int error) {
    switch (error) {
        case ENOENT:
        case ENOTDIR:
            return "no such file; check the path";
        case EACCES:
        case EPERM:
            return "may not be read; check its permissions";
        case ELOOP:
            return "is a loop of symbolic links; give the file itself";
        case ENAMETOOLONG:
            return "name too long; check the path";
        default:
            return fmt::format("cannot be opened: {}; check the path",
                               std::generic_category().message(error));
    }
}

void require_regular(const fs::path& path, const struct stat& status) {
    if (S_ISREG(status.st_mode)) return;
    fail(path, S_ISDIR(status.st_mode) ? "is a folder; give a file"
                                       : "is a pipe or device; give a regular file");
}

std::size_t read_up_to(int fd, char* out, std::size_t size, const fs::path& path) {
    std::size_t done = 0;
    while (done < size) {
        // Linux reads at most 2 GiB less a page a call.
        const ssize_t count = read(fd, out + done, std::min<std::size_t>(size - done, 1u << 30));
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) {
            fail(path, fmt::format("cannot be read: {}; check the disk",
                                   std::generic_category().message(errno)));
        }
        if (count == 0) break;
        done += static_cast<std::size_t>(count);
    }
    return done;
}

[[noreturn]] void fail_changed(const fs::path& path) {
    fail(path, "changed while it was read; wait until it is complete");
}

void require_unchanged(const fs::path& path, const FileDescriptor& file, std::uint64_t size,
                       const std::timespec& modified) {
    struct stat now = {};
    if (fstat(file.fd(), &now) != 0 || static_cast<std::uint64_t>(now.st_size) != size ||
        now.st_mtim.tv_sec != modified.tv_sec || now.st_mtim.tv_nsec != modified.tv_nsec)
        fail_changed(path);
}

/// Opens a regular file, and tells what it is.
FileDescriptor open_regular(const fs::path& path, struct stat& status) {
    // O_NONBLOCK: opening a pipe without a writer returns at once; a regular file ignores it.
    FileDescriptor file(open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
    if (file.fd() < 0) {
        // A socket answers ENXIO.
        if (errno == ENXIO) fail(path, "is a pipe or device; give a regular file");
        fail(path, why_not_opened(errno));
    }
    if (fstat(file.fd(), &status) != 0) fail(path, why_not_opened(errno));
    require_regular(path, status);
    return file;
}

}  // namespace

std::string read_input_file(const fs::path& path, std::uint64_t max_bytes) {
    struct stat status = {};
    const FileDescriptor file = open_regular(path, status);
    const auto size = static_cast<std::uint64_t>(status.st_size);
    if (size > max_bytes) {
        throw Error(ErrorKind::kLimit,
                    fmt::format("{}: {} bytes are more than the {} that are read; split the scene",
                                escape(path), size, max_bytes));
    }

    std::string bytes(size, '\0');
    char beyond = 0;
    if (read_up_to(file.fd(), bytes.data(), size, path) != size ||
        read_up_to(file.fd(), &beyond, 1, path) != 0)
        fail_changed(path);
    require_unchanged(path, file, size, status.st_mtim);
    return bytes;
}

InputFile::InputFile(const fs::path& path)
    : path_(path), file_([&] {
          struct stat status = {};
          FileDescriptor file = open_regular(path, status);
          size_ = static_cast<std::uint64_t>(status.st_size);
          modified_ = status.st_mtim;
          return file;
      }()) {}

void InputFile::read(std::uint64_t offset, std::span<std::byte> out) const {
    while (!out.empty()) {
        const std::size_t most = std::min<std::size_t>(out.size(), 1u << 30);
        const ssize_t count = pread(file_.fd(), out.data(), most, static_cast<off_t>(offset));
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) {
            fail(path_, fmt::format("cannot be read: {}; check the disk",
                                    std::generic_category().message(errno)));
        }
        if (count == 0) fail_changed(path_);
        out = out.subspan(static_cast<std::size_t>(count));
        offset += static_cast<std::uint64_t>(count);
    }
    require_unchanged(path_, file_, size_, modified_);
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
