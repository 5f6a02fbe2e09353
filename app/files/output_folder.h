// The folder that images go into.
#pragma once

#include <filesystem>

namespace morphray::app {

/// Exists and can be written to while this lives. What had to be created for it and is still empty
/// at the end is removed again, so that a command that produces nothing leaves nothing.
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
    /// The topmost folder that did not exist before; empty if all did.
    std::filesystem::path first_created_;
};

}  // namespace morphray::app
