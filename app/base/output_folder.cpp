#include "app/base/output_folder.h"

#include "common/base/output_file.h"

namespace mray::app {
namespace {

namespace fs = std::filesystem;

fs::path first_missing(const fs::path& path) {
    std::error_code error;
    fs::path missing;
    for (fs::path folder = path; !folder.empty() && !fs::exists(folder, error);
         folder = folder.parent_path()) {
        missing = folder;
    }
    return missing;
}

}  // namespace

OutputFolder::OutputFolder(const fs::path& path)
    // "a/b/" would otherwise have the parent "a/b".
    : path_(path.has_filename() ? path : path.parent_path()), first_created_(first_missing(path_)) {
    make_output_folder(path_);
}

OutputFolder::~OutputFolder() {
    if (first_created_.empty()) return;
    std::error_code error;
    // remove() fails for the first folder that is not empty, which ends the loop.
    for (fs::path folder = path_; fs::remove(folder, error) && folder != first_created_;) {
        folder = folder.parent_path();
    }
}

}  // namespace mray::app
