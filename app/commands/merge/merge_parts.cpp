#include "app/commands/merge/merge_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <system_error>

#include "app/commands/merge/opinions.h"
#include "app/farm/existing_image.h"
#include "app/files/png_reader.h"
#include "app/terminal/interrupt.h"
#include "common/base/errors.h"
#include "common/base/folder_entries.h"
#include "common/image/frame.h"
#include "common/text/message_text.h"
#include "common/text/number_text.h"

namespace mray::app {
namespace {

namespace fs = std::filesystem;

bool is_part_name(const std::string& name) {
    return name.starts_with("part-") && name.ends_with(".json") &&
           name.find("-of-") != std::string::npos;
}

std::vector<fs::path> part_files(const std::string& folder) {
    std::vector<fs::path> files;
    const std::error_code error = for_each_entry(folder, [&](const std::string& name) {
        if (is_part_name(name)) files.push_back(fs::path(folder) / name);
    });
    if (error) {
        throw Error(ErrorKind::kBadInput, fmt::format("{}: cannot be read ({}); give a folder",
                                                      shown(folder), error.message()));
    }
    if (files.empty()) {
        throw Error(ErrorKind::kBadInput,
                    fmt::format("{}: has no part of a render; give the --out folder of a `morphray "
                                "render --shard`",
                                shown(folder)));
    }
    std::sort(files.begin(), files.end());
    return files;
}

bool knows_scene(const Part& part) { return !part.render.frames.empty(); }

/// The first property in which a part is not of the same render; empty if there is none.
std::string difference(const Part& part, const Part& first) {
    const PartRender& a = part.render;
    const PartRender& b = first.render;
    if (part.shard.count != first.shard.count)
        return fmt::format("{} parts, not {}", part.shard.count, first.shard.count);
    if (a.software != b.software) return fmt::format("'{}', not '{}'", a.software, b.software);
    if (a.source != b.source) return fmt::format("the command '{}', not '{}'", a.source, b.source);
    if (a.scene_hash != b.scene_hash)
        return fmt::format("a scene with hash {}, not {}", hash_text(a.scene_hash),
                           hash_text(b.scene_hash));
    if (a.verify_every != b.verify_every)
        return fmt::format("--verify-every {}, not {}", a.verify_every, b.verify_every);
    if (a.frames != b.frames)
        return fmt::format("{} frames, not the same {}", a.frames.size(), b.frames.size());
    return a == b ? "" : "another size of scene or image";
}

class Checker {
public:
    explicit Checker(std::vector<Part> parts) { report_.parts = std::move(parts); }

    MergeReport check() {
        check_shards();
        check_agreement();
        for (const Part& part : report_.parts)
            for (const PartImage& image : part.images) add_image(part, image);
        for (const Part& part : report_.parts)
            for (const PartImage& image : part.checks) add_check(part, image);
        check_frames();
        check_opinions();
        return std::move(report_);
    }

private:
    const Part& first() const { return report_.first(); }

    void find(FindingKind kind, std::string text, std::uint32_t shard, const std::string& host,
              std::optional<double> frame = std::nullopt) {
        report_.findings.push_back({kind, std::move(text), shard, host, frame});
    }

    void check_shards() {
        std::map<std::uint32_t, const Part*> seen;
        for (const Part& part : report_.parts) {
            if (const auto [at, is_new] = seen.emplace(part.shard.index, &part); !is_new)
                find(FindingKind::kDuplicate,
                     fmt::format("the shard has parts in {} and {}", shown(at->second->folder),
                                 shown(part.folder)),
                     part.shard.index, part.host);
            if (part.state == PartState::kDone) continue;
            find(FindingKind::kUnfinished,
                 part.state == PartState::kRunning
                     ? "it runs still, or was killed"
                     : fmt::format("{} (exit code {}): {}", name_of(part.state),
                                   part.exit_code.value_or(0), part.reason),
                 part.shard.index, part.host);
        }
        for (std::uint32_t i = 1; i <= first().shard.count; ++i)
            if (!seen.contains(i)) find(FindingKind::kMissingPart, "it has no part", i, "");
    }

    void check_agreement() {
        for (const Part& part : report_.parts) {
            if (!knows_scene(part)) continue;
            const std::string text = difference(part, first());
            if (text.empty()) continue;
            find(FindingKind::kDiffers,
                 fmt::format("it has {} as shard {}", text, first().shard.index), part.shard.index,
                 part.host);
        }
    }

    /// Reads the files of an image; false, with findings, if one is not what the part says.
    bool is_whole(const Part& part, const PartImage& image) {
        throw_if_interrupted();
        try {
            const PngFile png = read_png_file(part.folder / image.file);
            if (const std::uint64_t hash = image_hash(png.image.pixels); hash != image.image_hash)
                return damaged(part, image,
                               fmt::format("{}: its pixels have the hash {}, not {}", image.file,
                                           hash_text(hash), hash_text(image.image_hash)));
            if (png.image.width != part.render.width || png.image.height != part.render.height)
                return damaged(part, image, fmt::format("{}: has another size", image.file));
            if (png.text("Scene hash") != hash_text(image.scene_hash) ||
                png.text("Software") != part.render.software)
                return damaged(part, image,
                               fmt::format("{}: is of another scene or version", image.file));
            for (const PartOutput& output : image.outputs) {
                if (file_hash(part.folder / output.file) != output.hash)
                    return damaged(
                        part, image,
                        fmt::format("{}: is not the file that was written", output.file));
            }
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::kBadInput && error.kind() != ErrorKind::kLimit) throw;
            return damaged(part, image, error.what());
        }
        return true;
    }

    bool damaged(const Part& part, const PartImage& image, std::string text) {
        find(FindingKind::kDamaged, std::move(text), part.shard.index, host_of(part, image),
             image.frame);
        return false;
    }

    static const std::string& host_of(const Part& part, const PartImage& image) {
        return image.host.empty() ? part.host : image.host;
    }

    void add_image(const Part& part, const PartImage& image) {
        const auto [at, is_new] = images_.emplace(image.frame, &part);
        if (!is_new) {
            repeated_.insert(image.frame);
            find(FindingKind::kDuplicate,
                 fmt::format("shard {} on {} has it, too", at->second->shard.index,
                             at->second->host),
                 part.shard.index, host_of(part, image), image.frame);
            return;
        }
        if (!is_whole(part, image)) return;
        report_.frames.push_back({image.frame, part.folder / image.file});
        add_opinion(part, image);
    }

    void add_check(const Part& part, const PartImage& image) {
        if (is_whole(part, image)) add_opinion(part, image);
    }

    void add_opinion(const Part& part, const PartImage& image) {
        opinions_[image.frame].push_back(
            {part.shard.index, host_of(part, image), image.image_hash, image.hits_hash});
        scenes_[image.frame].push_back(image.scene_hash);
    }

    void check_frames() {
        std::erase_if(report_.frames,
                      [&](const MergedFrame& merged) { return repeated_.contains(merged.frame); });
        std::ranges::sort(report_.frames, {}, &MergedFrame::frame);
        const std::vector<double>& all = first().render.frames;
        for (std::size_t i = 0; i < all.size(); ++i) {
            if (images_.contains(all[i])) continue;
            const std::uint32_t owner = owner_of(all.size(), i, first().shard.count);
            find(FindingKind::kMissing, "no image", owner, host_of_shard(owner), all[i]);
        }
        for (const auto& [frame, part] : images_) {
            if (std::ranges::binary_search(all, frame)) continue;
            find(FindingKind::kDiffers, "not a frame of the render", part->shard.index, part->host,
                 frame);
        }
    }

    std::string host_of_shard(std::uint32_t shard) const {
        for (const Part& part : report_.parts)
            if (part.shard.index == shard) return part.host;
        return {};
    }

    void check_opinions() {
        for (const auto& [frame, opinions] : opinions_) {
            for (std::size_t i = 1; i < opinions.size(); ++i) {
                ++report_.comparisons;
                if (opinions[i].host == opinions[0].host) ++report_.same_host;
            }
            const std::vector<std::uint64_t>& scenes = scenes_[frame];
            if (std::ranges::count(scenes, scenes.front()) !=
                static_cast<std::ptrdiff_t>(scenes.size()))
                find(FindingKind::kDiffers, "shards read different positions of its vertices",
                     opinions[0].shard, opinions[0].host, frame);
            const Verdict verdict = judge(opinions);
            add_suspects(verdict, report_.suspects);
            for (const Opinion& wrong : verdict.wrong) {
                find(FindingKind::kDisagreement,
                     fmt::format("{}: image {}, hits {}",
                                 verdict.is_decided ? "the other shards agree on another image"
                                                    : "shards differ, and none has a majority",
                                 hash_text(wrong.image_hash), hash_text(wrong.hits_hash)),
                     wrong.shard, wrong.host, frame);
            }
        }
        check_that_all_were_checked();
    }

    void check_that_all_were_checked() {
        const PartRender& render = first().render;
        for (const Part& part : report_.parts) {
            for (const std::size_t i :
                 checked_frames(render.frames.size(), part.shard, render.verify_every)) {
                const double frame = render.frames[i];
                if (std::ranges::find(part.checks, frame, &PartImage::frame) == part.checks.end())
                    find(FindingKind::kUnverified, "not rendered again by the shard",
                         part.shard.index, part.host, frame);
            }
        }
    }

    MergeReport report_;
    std::map<double, const Part*> images_;
    /// Frames with several images.
    std::set<double> repeated_;
    /// The opinions on each frame; its owner's comes first.
    std::map<double, std::vector<Opinion>> opinions_;
    std::map<double, std::vector<std::uint64_t>> scenes_;
};

}  // namespace

const char* name_of(FindingKind kind) {
    switch (kind) {
        case FindingKind::kMissingPart:
            return "missing part";
        case FindingKind::kUnfinished:
            return "unfinished";
        case FindingKind::kDiffers:
            return "differs";
        case FindingKind::kMissing:
            return "missing";
        case FindingKind::kDuplicate:
            return "duplicate";
        case FindingKind::kDamaged:
            return "damaged";
        case FindingKind::kDisagreement:
            return "disagreement";
        case FindingKind::kUnverified:
            return "unverified";
    }
    return "";
}

const Part& MergeReport::first() const {
    const auto found = std::ranges::find_if(parts, knows_scene);
    return found == parts.end() ? parts.front() : *found;
}

std::vector<Part> read_parts(const std::vector<std::string>& folders) {
    std::vector<Part> parts;
    for (const std::string& folder : folders)
        for (const fs::path& file : part_files(folder)) parts.push_back(read_part(file));
    std::ranges::stable_sort(parts, {}, [](const Part& part) { return part.shard.index; });
    return parts;
}

MergeReport check_parts(std::vector<Part> parts) { return Checker(std::move(parts)).check(); }

}  // namespace mray::app
