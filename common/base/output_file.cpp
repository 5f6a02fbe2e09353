#include "common/base/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "common/base/errors.h"
#include "common/base/file_descriptor.h"
#include "common/base/temporary_file.h"
#include "common/text/number_text.h"

namespace mray {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail_output(const fs::path& path, const std::string& what, const char* remedy) {
    throw Error(ErrorKind::kOutput, fmt::format("{}: {}; {}", path.native(), what, remedy));
}

[[noreturn]] void fail_with_errno(const fs::path& path, int error) {
    const char* remedy = "choose another place for the output";
    if (error == ENOSPC || error == EDQUOT) remedy = "free some space or choose another place";
    if (error == ENOENT) remedy = "create the folder first";
    if (error == ENAMETOOLONG) remedy = "choose a shorter name";
    if (error == EPIPE) remedy = "the reader of the output has ended";
    fail_output(path, "cannot be written (" + std::generic_category().message(error) + ")", remedy);
}

/// The descriptor that /dev/stdout, /dev/stderr or /dev/fd/N names. A file that the descriptor was
/// redirected to must be written through it: after a rename it would still refer to the old file.
std::optional<int> named_descriptor(const fs::path& path) {
    const std::string& name = path.native();
    if (name == "/dev/stdout") return STDOUT_FILENO;
    if (name == "/dev/stderr") return STDERR_FILENO;
    for (const std::string_view folder : {"/dev/fd/", "/proc/self/fd/"}) {
        if (!name.starts_with(folder)) continue;
        const auto fd = parse_unsigned(std::string_view(name).substr(folder.size()));
        if (fd && *fd <= INT_MAX) return static_cast<int>(*fd);
    }
    return std::nullopt;
}

/// The last target of the links that start at `path`; it need not exist.
fs::path follow_links(const fs::path& path) {
    constexpr int kMaxLinks = 40;  // as many as the kernel follows
    fs::path target = path;
    for (int i = 0; i < kMaxLinks; ++i) {
        std::error_code error;
        const fs::path link = fs::read_symlink(target, error);
        if (error) return target;
        target = target.parent_path() / link;
    }
    fail_with_errno(path, ELOOP);
}

enum class Target { kFile, kDescriptor, kStream };

/// How `path` is to be written. Throws if its type or permissions already exclude that.
Target classify(const fs::path& path) {
    if (path.empty()) fail_output("''", "an output needs a name", "give a file name");
    if (named_descriptor(path)) return Target::kDescriptor;
    struct stat status = {};
    if (::stat(path.c_str(), &status) != 0) {
        if (!path.has_filename()) fail_output(path, "is the name of a folder", "give a file name");
        if (errno == ENOENT)
            return Target::kFile;  // creating the temporary shows whether it can be written
        fail_with_errno(path, errno);
    }
    if (S_ISDIR(status.st_mode)) fail_output(path, "is a folder", "give a file name");
    // A rename could replace an existing file without write permission; its owner forbade that.
    if (::access(path.c_str(), W_OK) != 0) fail_with_errno(path, errno);
    return S_ISREG(status.st_mode) ? Target::kFile : Target::kStream;
}

void write_regular_file(const fs::path& path, std::span<const std::byte> bytes) {
    const fs::path target = follow_links(path);
    TemporaryFile temporary(target.parent_path());
    if (!temporary.is_open()) fail_with_errno(path, errno);
    struct stat old = {};
    if (::stat(target.c_str(), &old) == 0) ::fchmod(temporary.fd(), old.st_mode & 07777);
    if (const int error = write_all(temporary.fd(), bytes)) fail_with_errno(path, error);
    if (::fsync(temporary.fd()) != 0) fail_with_errno(path, errno);
    if (const int error = temporary.rename_to(target)) fail_with_errno(path, error);
}

void write_stream(const fs::path& path, int fd, std::span<const std::byte> bytes) {
    FileDescriptor stream(fd);
    if (fd < 0) fail_with_errno(path, errno);
    if (const int error = write_all(fd, bytes)) fail_with_errno(path, error);
    if (const int error = stream.close()) fail_with_errno(path, error);
}

}  // namespace

void write_file(const fs::path& path, std::span<const std::byte> bytes) {
    switch (classify(path)) {
        case Target::kFile:
            return write_regular_file(path, bytes);
        case Target::kDescriptor:
            return write_stream(path, ::dup(*named_descriptor(path)), bytes);
        case Target::kStream:
            return write_stream(path, ::open(path.c_str(), O_WRONLY | O_CLOEXEC), bytes);
    }
}

void write_file(const fs::path& path, std::string_view text) {
    write_file(path, std::as_bytes(std::span(text)));
}

void check_writable(const fs::path& path) {
    // A folder's mode is not reliable (root, read-only and virtual file systems), so try it.
    if (classify(path) != Target::kFile) return;
    const fs::path folder = follow_links(path).parent_path();
    remove_stray_files(folder);
    if (!TemporaryFile(folder).is_open()) fail_with_errno(path, errno);
}

void make_output_folder(const fs::path& path) {
    if (path.empty()) fail_output("''", "an output folder needs a name", "give a folder name");
    std::error_code error;
    fs::create_directories(path, error);
    if (error) {
        fail_output(path, "folder cannot be created (" + error.message() + ")",
                    "choose another place for the output");
    }
    remove_stray_files(path);
    if (!TemporaryFile(path).is_open()) fail_with_errno(path, errno);
}

}  // namespace mray
