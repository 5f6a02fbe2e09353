#include "tests/fuzz/targets/case_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <stdexcept>
#include <system_error>

namespace mray::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr const char* kMemory = "/dev/shm";

class Folder {
public:
    Folder() {
        const fs::path parent = access(kMemory, W_OK) == 0 ? kMemory : fs::temp_directory_path();
        std::string name = (parent / "morphray_XXXXXX").native();
        if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp");
        path_ = name;
    }
    ~Folder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;

    const fs::path& path() const { return path_; }

private:
    fs::path path_;
};

}  // namespace

const fs::path& case_folder() {
    static const Folder folder;
    return folder.path();
}

void CaseFile::write(std::string_view bytes) {
    if (!file_) file_.emplace(open(path_.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
    const bool is_written =
        pwrite(file_->fd(), bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size());
    const bool is_cut =
        bytes.size() >= size_ || ftruncate(file_->fd(), static_cast<off_t>(bytes.size())) == 0;
    if (!is_written || !is_cut) throw std::runtime_error("cannot write " + path_);
    size_ = bytes.size();
}

void CaseFile::remove() {
    if (!file_) return;
    unlink(path_.c_str());
    file_.reset();
    size_ = 0;
}

}  // namespace mray::fuzz
