#include "common/base/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <optional>
#include <system_error>

#include "common/base/errors.h"
#include "common/text/text.h"

namespace mray {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail_output(const fs::path& path, const std::string& what, const char* hint) {
    throw Error(ErrorKind::kOutput, "{}: {}; {}", path.native(), what, hint);
}

[[noreturn]] void fail_with_errno(const fs::path& path, int error) {
    const char* hint = "choose another place for the output";
    if (error == ENOSPC || error == EDQUOT) hint = "free some space or choose another place";
    if (error == ENOENT) hint = "create the folder first";
    fail_output(path, "cannot be written (" + std::generic_category().message(error) + ")", hint);
}

/// A new file in a folder, `.morphray-PROCESS-NUMBER.partial`, which vanishes unless it is renamed.
/// The name is short, because the target's may already have the greatest length.
class PartialFile {
public:
    PartialFile(const fs::path& folder, const fs::path& for_errors) : for_errors_(for_errors) {
        // The mode is left to the umask, as for any new file.
        for (int number = 0; fd_ < 0; ++number) {
            name_ = folder / fmt::format(".morphray-{}-{}.partial", ::getpid(), number);
            fd_ = ::open(name_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
            if (fd_ < 0 && errno != EEXIST) fail_with_errno(for_errors, errno);
        }
    }
    ~PartialFile() {
        ::close(fd_);
        if (!renamed_) ::unlink(name_.c_str());
    }
    PartialFile(const PartialFile&) = delete;
    PartialFile& operator=(const PartialFile&) = delete;

    int fd() const { return fd_; }
    void rename_to(const fs::path& target) {
        if (::fsync(fd_) != 0 || ::rename(name_.c_str(), target.c_str()) != 0)
            fail_with_errno(for_errors_, errno);
        renamed_ = true;
    }

private:
    fs::path for_errors_;
    fs::path name_;
    int fd_ = -1;
    bool renamed_ = false;
};

/// The descriptor that /dev/stdout, /dev/stderr or /dev/fd/N names. A file that the descriptor was
/// redirected to must be written through it: after a rename it would still refer to the old file.
std::optional<int> named_descriptor(const fs::path& path) {
    if (path == "/dev/stdout") return STDOUT_FILENO;
    if (path == "/dev/stderr") return STDERR_FILENO;
    if (path.parent_path() != "/dev/fd") return std::nullopt;
    const auto fd = parse_unsigned(path.filename().native());
    return fd && *fd < 1u << 20 ? std::optional<int>(*fd) : std::nullopt;
}

/// Whether `path` is or becomes a regular file. Throws if type or permissions exclude writing it.
bool is_for_file(const fs::path& path) {
    if (path.empty()) fail_output("''", "an output needs a name", "give a file name");
    struct stat status = {};
    if (::stat(path.c_str(), &status) != 0) {
        if (!path.has_filename()) fail_output(path, "is the name of a folder", "give a file name");
        if (errno == ENOENT) return true;  // creating the temporary shows whether it can be written
        fail_with_errno(path, errno);
    }
    if (S_ISDIR(status.st_mode)) fail_output(path, "is a folder", "give a file name");
    // A rename could replace an existing file without write permission; its owner forbade that.
    if (::access(path.c_str(), W_OK) != 0) fail_with_errno(path, errno);
    return S_ISREG(status.st_mode);
}

/// The file that a link leads to is written, and the link stays.
fs::path follow_links(const fs::path& path) {
    std::error_code error;
    const fs::path target = fs::canonical(path, error);
    return error ? fs::absolute(path) : target;
}

void write_all(const fs::path& path, int fd, std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(fd, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) fail_with_errno(path, errno);
        bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
}

void write_regular_file(const fs::path& path, std::span<const std::byte> bytes) {
    const fs::path target = follow_links(path);
    PartialFile file(target.parent_path(), path);
    struct stat old = {};
    if (::stat(target.c_str(), &old) == 0) ::fchmod(file.fd(), old.st_mode & 07777);
    write_all(path, file.fd(), bytes);
    file.rename_to(target);
}

}  // namespace

void write_file(const fs::path& path, std::span<const std::byte> bytes) {
    if (const auto fd = named_descriptor(path)) return write_all(path, *fd, bytes);
    if (is_for_file(path)) return write_regular_file(path, bytes);
    const int fd = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (fd < 0) fail_with_errno(path, errno);
    write_all(path, fd, bytes);
    ::close(fd);
}

void write_file(const fs::path& path, std::string_view text) {
    write_file(path, std::as_bytes(std::span(text)));
}

void check_writable(const fs::path& path) {
    // A folder's mode is not reliable (root, read-only and virtual file systems), so try it.
    if (!named_descriptor(path) && is_for_file(path))
        PartialFile(follow_links(path).parent_path(), path);
}

void make_output_folder(const fs::path& path) {
    if (path.empty()) fail_output("''", "an output folder needs a name", "give a folder name");
    std::error_code error;
    fs::create_directories(path, error);
    if (error) fail_with_errno(path, error.value());
    PartialFile(path, path);
}

}  // namespace mray
