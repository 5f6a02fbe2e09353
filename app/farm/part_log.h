// Keeps the part of a shard up to date on the disk.
#pragma once

#include <exception>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/base/exit_code.h"
#include "app/base/options.h"
#include "app/farm/frame_tasks.h"
#include "app/farm/part.h"
#include "clips/clip.h"

namespace mray::app {

/// Writes the part of options.farm.shard into a folder when the work begins and when it ends,
/// however it ends; a shard that is killed leaves a part that says "running". Without a shard it
/// does nothing. Not thread-safe.
class PartLog {
public:
    /// `options` are those of with_render_defaults(). Reads the part of an earlier run, if there is
    /// one that can be read.
    PartLog(const Options& options, const std::filesystem::path& folder);
    PartLog(const PartLog&) = delete;
    PartLog& operator=(const PartLog&) = delete;

    /// Runs `work`, which returns an exit code, and writes the part before, unless that of an
    /// earlier run is there to be continued, and how `work` ended. Throws what `work` throws, and
    /// Error(kOutput) if the part cannot be written and nothing else failed.
    template <class Work>
    ExitCode record(Work work) {
        try {
            if (!earlier_) begin();
            const ExitCode code = work();
            end(code);
            return code;
        } catch (...) {
            end_with(std::current_exception());
            throw;
        }
    }

    /// Sets what is rendered.
    void set_scene(const Clip& clip, std::uint64_t clip_hash, const std::vector<double>& frames,
                   const std::vector<FrameTask>& tasks);
    /// Writes what is known of the part. Throws Error(kOutput).
    void begin();
    void set_device(const std::string& backend, const std::string& device);
    /// Adds an image of this machine; its host, backend and device are filled in.
    void add(const FrameTask& task, PartImage image);
    /// Adds an image of an earlier run, whose host, backend and device are those of its part.
    void keep(const FrameTask& task, PartImage image);
    /// Why the last frames are missing, if the work ends without an exception.
    void set_reason(const std::string& reason) { part_.reason = reason; }

    /// The image as the part of an earlier run has it; null if it does not.
    const PartImage* earlier(const FrameTask& task) const;

private:
    void put(const FrameTask& task, PartImage image);
    void end(ExitCode code);
    void end_with(const std::exception_ptr& failure);
    void write() const;

    bool is_on_ = false;
    std::filesystem::path folder_;
    Part part_;
    std::optional<Part> earlier_;
};

/// The name of this machine: $SLURMD_NODENAME, which Slurm sets, or the name of the host.
std::string host_name();

}  // namespace mray::app
