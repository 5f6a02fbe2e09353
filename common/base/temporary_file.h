// A file that gets its name when it is whole.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/file_descriptor.h"

namespace mray {

/// A new empty file in a folder, which takes the place of another one by rename_to() and vanishes
/// otherwise. Where the file system can, it has no name until then, so that nothing remains of it
/// however the process ends; elsewhere it is `.morphray-HOST-PROCESS-NUMBER.partial`, which
/// remove_stray_files() removes after a kill. That name is short, because the target's may already
/// have the greatest length.
class TemporaryFile {
public:
    /// On failure is_open() is false and errno set.
    explicit TemporaryFile(const std::filesystem::path& folder);
    ~TemporaryFile();
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;

    bool is_open() const { return file_.fd() >= 0; }
    int fd() const { return file_.fd(); }
    /// Gives the file its temporary name, closes it and renames it to `target`, in the same folder,
    /// which is replaced. Returns 0, or errno.
    int rename_to(const std::filesystem::path& target);

private:
    int create();
    int link();

    std::filesystem::path folder_;
    /// Empty: the file has no name.
    std::filesystem::path name_;
    FileDescriptor file_;
};

/// Removes the temporary files in a folder whose processes ran on this host and have ended.
void remove_stray_files(const std::filesystem::path& folder);

}  // namespace mray
