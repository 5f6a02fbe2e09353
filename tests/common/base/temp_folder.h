// A folder for the files of a test, and what a call throws.
#pragma once

#include <stdlib.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>

#include "common/base/errors.h"

namespace mray {

class TempFolder {
public:
    TempFolder() {
        std::string name = (std::filesystem::temp_directory_path() / "morphray_XXXXXX").native();
        if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp");
        path_ = name;
        chmod(name.c_str(), 0755);
    }
    ~TempFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TempFolder(const TempFolder&) = delete;
    TempFolder& operator=(const TempFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

    /// Writes a file, with the folders that its name has, and returns its path.
    std::filesystem::path write(const std::string& name, const std::string& bytes) const {
        const std::filesystem::path path = path_ / name;
        std::filesystem::create_directories(path.parent_path());
        std::ofstream(path, std::ios::binary) << bytes;
        return path;
    }

private:
    std::filesystem::path path_;
};

/// The Error that a call throws, if it does.
template <class Call>
std::optional<Error> error_of(const Call& call) {
    try {
        call();
    } catch (const Error& error) {
        return error;
    }
    return std::nullopt;
}

template <class Call>
std::optional<ErrorKind> kind_of(const Call& call) {
    const auto error = error_of(call);
    return error ? std::optional(error->kind()) : std::nullopt;
}

/// The text of the Error that a call throws; empty if it throws none.
template <class Call>
std::string message_of(const Call& call) {
    const auto error = error_of(call);
    return error ? error->what() : "";
}

}  // namespace mray
