// The folder of output images.
#pragma once

#include <filesystem>

namespace mray::app {

/// A folder that exists and is writable while this lives. The destructor removes the folders that
/// the constructor created if they are still empty, so that a command without output leaves none.
class OutputFolder {
public:
    /// Throws Error(kOutput).
    explicit OutputFolder(const std::filesystem::path& path);
    ~OutputFolder();
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

private:
    std::filesystem::path path_;
    /// The topmost folder that did not exist before; empty if all existed.
    std::filesystem::path first_created_;
};

}  // namespace mray::app
