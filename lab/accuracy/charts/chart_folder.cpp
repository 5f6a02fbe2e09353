#include "lab/accuracy/charts/chart_folder.h"

#include <fmt/format.h>
#include <stdlib.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>

#include "common/base/errors.h"
#include "common/base/output_file.h"

namespace mray::accuracy {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::string& why) {
    throw Error(ErrorKind::kOutput, fmt::format("{}: {}", path.string(), why));
}

}  // namespace

ChartFolder::ChartFolder(const fs::path& path)
    // "a/b/" would otherwise have the parent "a/b".
    : path_(path.has_filename() ? path : path.parent_path()) {
    std::error_code error;
    if (fs::exists(path_, error)) {
        if (!fs::is_directory(path_, error))
            fail(path_, "is not a folder; name one that does not exist yet");
        if (!fs::is_empty(path_, error))
            fail(path_, "is not empty; name another folder, or empty this one");
    }
    const fs::path parent = path_.has_parent_path() ? path_.parent_path() : ".";
    make_output_folder(parent);
    std::string name = (parent / (path_.filename().string() + ".partial-XXXXXX")).string();
    if (mkdtemp(name.data()) == nullptr)
        fail(path_, fmt::format("{}; choose another folder", std::strerror(errno)));
    temporary_ = name;
    // mkdtemp makes the folder private; give it the mode of any new folder.
    const mode_t mask = umask(0);
    umask(mask);
    chmod(name.c_str(), 0777 & ~mask);
}

ChartFolder::~ChartFolder() {
    std::error_code error;
    if (!temporary_.empty()) fs::remove_all(temporary_, error);
}

void ChartFolder::write(const std::string& name, std::string_view text) const {
    write_file(temporary_ / name, text);
}

void ChartFolder::keep() {
    std::error_code error;
    fs::rename(temporary_, path_, error);
    if (error) fail(path_, fmt::format("{}; choose another folder", error.message()));
    temporary_.clear();
}

}  // namespace mray::accuracy
