// Files of the positions of a mesh's vertices at many times: PC2 and MDD.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "common/base/input_file.h"
#include "common/interop/platform.h"

namespace mray {

/// A file in one of two formats, told apart by its first bytes and its name:
///
/// - PC2 (Autodesk 3ds Max, Blender): "POINTCACHE2" and a zero; version 1, the number of points,
/// the
///   first frame, the frames from a sample to the next, the number of samples; then x, y, z of
///   every point of every sample. Little-endian, 32 bits a number.
/// - MDD (NewTek LightWave; its name ends with .mdd): the numbers of samples and points; a time for
///   each sample, which is not used; then as above. Big-endian. Samples are frames 0, 1, 2, ...
///
/// Threads may share one.
class PointCache {
public:
    /// Reads the head. Throws Error(kBadInput) with the file and the reason if it is not such a
    /// file, if its size is not what the head says, or if it has no samples.
    explicit PointCache(const std::filesystem::path& path);

    const std::filesystem::path& path() const { return file_.path(); }
    std::size_t sample_count() const { return sample_count_; }
    std::uint32_t point_count() const { return point_count_; }
    /// The frame of a sample; frames increase.
    double frame(std::size_t sample) const {
        return first_frame_ + static_cast<double>(sample) * frames_per_sample_;
    }
    /// Reads the positions of a sample; out has point_count() entries. Throws Error(kBadInput) if
    /// the file cannot be read.
    void read(std::size_t sample, std::span<vec3> out) const;

private:
    void read_pc2_head();
    void read_mdd_head();
    [[noreturn]] void fail(const std::string& what) const;
    void require_size() const;

    InputFile file_;
    bool is_big_endian_ = false;
    std::uint64_t head_size_ = 0;
    std::size_t sample_count_ = 0;
    std::uint32_t point_count_ = 0;
    double first_frame_ = 0;
    double frames_per_sample_ = 1;
};

}  // namespace mray
