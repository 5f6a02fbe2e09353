#include "common/base/temporary_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <optional>
#include <string_view>

#include "common/base/hash.h"
#include "common/base/input_file.h"
#include "common/text/number_text.h"

namespace mray {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSuffix = ".partial";

/// The prefix of the names of this host's temporary files. Several hosts may share a folder.
std::string host_prefix() {
    char host[HOST_NAME_MAX + 1] = {};
    ::gethostname(host, sizeof host - 1);
    const std::string_view name(host);
    const std::uint64_t hash = Hasher().add(std::span(name.data(), name.size())).digest();
    return fmt::format(".morphray-{:08x}-", static_cast<std::uint32_t>(hash));
}

fs::path numbered_name(const fs::path& folder, int number) {
    return folder / fmt::format("{}{}-{}{}", host_prefix(), ::getpid(), number, kSuffix);
}

/// The process that a temporary file of this host belongs to.
std::optional<pid_t> process_of(std::string_view name, std::string_view prefix) {
    if (!name.starts_with(prefix) || !name.ends_with(kSuffix)) return std::nullopt;
    name = name.substr(prefix.size());
    const auto process = parse_unsigned(name.substr(0, name.find('-')));
    if (!process || *process == 0 || *process > INT_MAX) return std::nullopt;
    return static_cast<pid_t>(*process);
}

fs::path descriptor_path(int fd) { return fmt::format("/proc/self/fd/{}", fd); }

}  // namespace

TemporaryFile::TemporaryFile(const fs::path& folder)
    : folder_(folder.empty() ? fs::path(".") : folder), file_(create()) {}

TemporaryFile::~TemporaryFile() {
    if (!name_.empty()) ::unlink(name_.c_str());
}

// The mode is left to the umask, as for any new file.
int TemporaryFile::create() {
    const int fd = ::open(folder_.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
    if (fd >= 0) {
        if (::access(descriptor_path(fd).c_str(), F_OK) == 0) return fd;
        ::close(fd);
    }
    for (int number = 0;; ++number) {
        fs::path name = numbered_name(folder_, number);
        const int named = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (named >= 0) name_ = std::move(name);
        if (named >= 0 || errno != EEXIST) return named;
    }
}

int TemporaryFile::link() {
    const fs::path unnamed = descriptor_path(file_.fd());
    for (int number = 0;; ++number) {
        fs::path name = numbered_name(folder_, number);
        if (::linkat(AT_FDCWD, unnamed.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0) {
            name_ = std::move(name);
            return 0;
        }
        if (errno != EEXIST) return errno;
    }
}

int TemporaryFile::rename_to(const fs::path& target) {
    if (name_.empty()) {
        if (const int error = link()) return error;
    }
    if (const int error = file_.close()) return error;
    if (::rename(name_.c_str(), target.c_str()) != 0) return errno;
    name_.clear();
    return 0;
}

void remove_stray_files(const fs::path& folder) {
    const std::string prefix = host_prefix();
    for_each_entry(folder.empty() ? fs::path(".") : folder, [&](const std::string& name) {
        const auto process = process_of(name, prefix);
        if (!process || ::kill(*process, 0) == 0 || errno != ESRCH) return;
        const fs::path path = folder / name;
        struct stat status;
        if (::lstat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode)) ::unlink(path.c_str());
    });
}

}  // namespace mray
