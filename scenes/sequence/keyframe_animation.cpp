#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <utility>

#include "common/base/errors.h"
#include "common/base/hash.h"
#include "common/text/text_parts.h"
#include "scenes/mesh/mesh_file.h"
#include "scenes/sequence/streamed_animation.h"

namespace mray {
namespace {

std::uint64_t hash_of_faces(const Polygons& faces) {
    return Hasher().add(std::span(faces.corners)).add(std::span(faces.corner_counts)).digest();
}

class FileSource : public KeyframeSource {
public:
    FileSource(std::vector<KeyframeFile> files, const FirstMesh& first,
               const AnimationOptions& options)
        : files_(std::move(files)),
          vertex_count_(first.positions.size()),
          face_count_(first.faces.corner_counts.size()),
          faces_hash_(hash_of_faces(first.faces)) {
        positions_only_.lenient = options.lenient;
        positions_only_.materials = false;
    }

    std::size_t count() const override { return files_.size(); }
    double frame(std::size_t keyframe) const override { return files_[keyframe].frame; }
    std::optional<Warning> read(std::size_t keyframe, std::span<vec3> out) const override {
        const KeyframeFile& file = files_[keyframe];
        std::optional<Warning> first_warning;
        MeshFileOptions options = positions_only_;
        options.warn = [&](const Warning& warning) {
            if (!first_warning) first_warning = warning;
        };
        FileMesh mesh;
        try {
            mesh = read_mesh_file(file.path, options);
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::kBadInput) throw;
            const Warning at = as_warning(error, escape(file.path));
            throw Error(
                error.kind(),
                fmt::format("{}: frame {}: {}", at.place.empty() ? escape(file.path) : at.place,
                            file.frame, at.text),
                error.hint());
        }
        if (mesh.positions.size() != vertex_count_ || hash_of_faces(mesh.faces) != faces_hash_) {
            throw Error(
                ErrorKind::kBadInput,
                fmt::format("{}: frame {} has other faces ({} of {} vertices) than {} ({} of "
                            "{}); all frames of an animation share one topology, render "
                            "sequences that change it in separate runs",
                            escape(file.path), file.frame, mesh.faces.corner_counts.size(),
                            mesh.positions.size(), escape(files_.front().path), face_count_,
                            vertex_count_));
        }
        std::copy(mesh.positions.begin(), mesh.positions.end(), out.begin());
        return first_warning;
    }

private:
    std::vector<KeyframeFile> files_;
    std::size_t vertex_count_;
    std::size_t face_count_;
    std::uint64_t faces_hash_;
    MeshFileOptions positions_only_;
};

}  // namespace

std::unique_ptr<Animation> open_keyframes(const std::vector<KeyframeFile>& files,
                                          const std::string& name,
                                          const AnimationOptions& options) {
    assert(!files.empty());
    FirstMesh first = read_first_mesh(files[0].path, options);
    auto source = std::make_unique<FileSource>(files, first, options);
    return stream_keyframes(name, std::move(first), std::move(source), options.warn);
}

}  // namespace mray
