#include "tests/fuzz/targets/case_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <stdexcept>

#include "tests/support/temporary_folder.h"

namespace mray::fuzz {

const std::filesystem::path& case_folder() {
    constexpr const char* kMemory = "/dev/shm";
    static const test::TemporaryFolder folder(
        access(kMemory, W_OK) == 0 ? kMemory : std::filesystem::temp_directory_path());
    return folder.path();
}

void CaseFile::write(std::string_view bytes) {
    if (fd_ < 0) fd_ = open(path_.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    const bool is_written =
        pwrite(fd_, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size());
    const bool is_cut =
        bytes.size() >= size_ || ftruncate(fd_, static_cast<off_t>(bytes.size())) == 0;
    if (!is_written || !is_cut) throw std::runtime_error("cannot write " + path_);
    size_ = bytes.size();
}

void CaseFile::remove() {
    if (fd_ < 0) return;
    unlink(path_.c_str());
    close(fd_);
    fd_ = -1;
    size_ = 0;
}

}  // namespace mray::fuzz
