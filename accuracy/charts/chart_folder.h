// The folder that charts are written into: there is all of it or nothing.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace morphray::accuracy {

/// A folder of another name beside `path` until keep() gives it its own; removed with all that is
/// in it if that does not happen.
class ChartFolder {
public:
    /// Throws Error(kOutput) when `path` is there and not an empty folder, or when nothing can be
    /// made beside it.
    explicit ChartFolder(const std::filesystem::path& path);
    ~ChartFolder();
    ChartFolder(const ChartFolder&) = delete;
    ChartFolder& operator=(const ChartFolder&) = delete;

    void write(const std::string& name, std::string_view text) const;
    std::string read(const std::string& name) const;
    /// Runs gnuplot in it. Throws Error(kInternal) with what gnuplot says.
    void plot(const std::string& script) const;
    /// Throws Error(kOutput).
    void keep();

private:
    std::filesystem::path path_;
    std::filesystem::path temporary_;
};

/// Throws Error(kUnavailable) where there is no gnuplot.
void require_gnuplot();

}  // namespace morphray::accuracy
