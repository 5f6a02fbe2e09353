// A file whose content is another one in each case.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace mray::fuzz {

/// The folder of this process for such files, in memory where the system has a place for it;
/// removed at exit.
const std::filesystem::path& case_folder();

/// A file in case_folder(), made when it is first written.
class CaseFile {
public:
    explicit CaseFile(std::string_view name) : path_((case_folder() / name).native()) {}
    ~CaseFile() { remove(); }
    CaseFile(const CaseFile&) = delete;
    CaseFile& operator=(const CaseFile&) = delete;

    const std::string& path() const { return path_; }
    /// Makes these bytes the content. Throws std::runtime_error.
    void write(std::string_view bytes);
    void remove();

private:
    std::string path_;
    /// Negative before it is made.
    int fd_ = -1;
    std::size_t size_ = 0;
};

}  // namespace mray::fuzz
