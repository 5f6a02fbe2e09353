// The folder of the charts, written as a whole or not at all.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace mray::accuracy {

/// A temporary folder beside `path`, which keep() renames to `path`. Without keep() the destructor
/// removes it with its content.
class ChartFolder {
public:
    /// Throws Error(kOutput) if `path` exists and is not an empty folder, or if no folder can be
    /// created beside it.
    explicit ChartFolder(const std::filesystem::path& path);
    ~ChartFolder();
    ChartFolder(const ChartFolder&) = delete;
    ChartFolder& operator=(const ChartFolder&) = delete;

    void write(const std::string& name, std::string_view text) const;
    /// Renames the folder to `path`. Throws Error(kOutput).
    void keep();

private:
    std::filesystem::path path_;
    std::filesystem::path temporary_;
};

}  // namespace mray::accuracy
