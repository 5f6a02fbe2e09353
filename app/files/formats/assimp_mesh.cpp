#include "app/files/formats/assimp_mesh.h"

#include <assimp/scene.h>
#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "common/base/errors.h"
#include "common/base/hash.h"
#include "scenes/mesh/mesh_rules.h"

namespace mray::app {
namespace {

/// A transformation of positions: rows of a matrix of 3 x 4.
using Matrix = std::array<std::array<double, 4>, 3>;
constexpr Matrix kIdentity = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

Matrix matrix_of(const aiMatrix4x4& m) {
    return {{{m.a1, m.a2, m.a3, m.a4}, {m.b1, m.b2, m.b3, m.b4}, {m.c1, m.c2, m.c3, m.c4}}};
}

Matrix product(const Matrix& a, const Matrix& b) {
    Matrix result = {};
    for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 4; ++column) {
            result[row][column] = a[row][0] * b[0][column] + a[row][1] * b[1][column] +
                                  a[row][2] * b[2][column] + (column == 3 ? a[row][3] : 0);
        }
    }
    return result;
}

vec3 transformed(const Matrix& m, const aiVector3D& p) {
    if (m == kIdentity) return {p.x, p.y, p.z};
    const auto row = [&](std::size_t i) {
        return static_cast<float>(m[i][0] * static_cast<double>(p.x) +
                                  m[i][1] * static_cast<double>(p.y) +
                                  m[i][2] * static_cast<double>(p.z) + m[i][3]);
    };
    return {row(0), row(1), row(2)};
}

struct PositionBits {
    std::uint32_t x, y, z;
    bool operator==(const PositionBits&) const = default;
};
struct PositionHash {
    std::size_t operator()(const PositionBits& bits) const {
        return static_cast<std::size_t>(hash_of(bits));
    }
};

class Collector {
public:
    Collector(const aiScene& scene, const std::string& name, const MeshFileOptions& options)
        : scene_(scene), name_(name), rules_(options.lenient), options_(options) {}

    FileMesh run() {
        collect_nodes();
        if (scene_.mNumAnimations > 0)
            options_.warn({name_, "animations of this format are not read; its first pose is"});
        rules_.tell(options_.warn);
        return std::move(mesh_);
    }

private:
    struct Node {
        const aiNode* node;
        Matrix to_world;
    };

    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", name_, what));
    }

    void collect_nodes() {
        constexpr std::size_t kMostNodes = std::size_t{1} << 20;
        if (scene_.mRootNode == nullptr) return;
        std::vector<Node> open = {{scene_.mRootNode, kIdentity}};
        for (std::size_t count = 0; !open.empty(); ++count) {
            if (count == kMostNodes) {
                throw Error(ErrorKind::kLimit,
                            fmt::format("{}: more than {} nodes; join them", name_, kMostNodes));
            }
            const Node at = open.back();
            open.pop_back();
            const Matrix to_world = product(at.to_world, matrix_of(at.node->mTransformation));
            for (unsigned i = 0; i < at.node->mNumMeshes; ++i) {
                if (at.node->mMeshes[i] >= scene_.mNumMeshes)
                    fail(fmt::format("node with mesh {} of {}; write the file again",
                                     at.node->mMeshes[i], scene_.mNumMeshes));
                add_mesh(at.node->mMeshes[i], to_world);
            }
            for (unsigned i = at.node->mNumChildren; i > 0; --i)
                open.push_back({at.node->mChildren[i - 1], to_world});
        }
    }

    void add_mesh(unsigned index, const Matrix& to_world) {
        const aiMesh& mesh = *scene_.mMeshes[index];
        constexpr unsigned kAreas = aiPrimitiveType_TRIANGLE | aiPrimitiveType_POLYGON;
        if (mesh.mPrimitiveTypes != 0 && (mesh.mPrimitiveTypes & kAreas) == 0) return;
        std::vector<std::uint32_t> vertices;
        vertices.reserve(mesh.mNumVertices);
        for (unsigned i = 0; i < mesh.mNumVertices; ++i)
            vertices.push_back(vertex_of(transformed(to_world, mesh.mVertices[i]), index, i));
        const Albedo albedo = albedo_of_material(mesh.mMaterialIndex);
        for (unsigned i = 0; i < mesh.mNumFaces; ++i) add_face(mesh, index, i, vertices, albedo);
    }

    std::uint32_t vertex_of(const vec3& p, unsigned mesh, unsigned vertex) {
        for (int axis = 0; axis < 3; ++axis) {
            if (MeshRules::is_good(p[axis])) continue;
            rules_.take_bad_coordinate(p[axis], fmt::format("{}", p[axis]), [&] {
                return fmt::format("{}: mesh {}, vertex {}", name_, mesh, vertex);
            });
        }
        const auto bits = [](float x) { return std::bit_cast<std::uint32_t>(x + 0.0f); };
        const auto next = static_cast<std::uint32_t>(mesh_.positions.size());
        const auto [found, is_new] =
            vertices_.try_emplace(PositionBits{bits(p.x), bits(p.y), bits(p.z)}, next);
        if (is_new) mesh_.positions.push_back(p);
        return found->second;
    }

    void add_face(const aiMesh& mesh, unsigned index, unsigned face_index,
                  const std::vector<std::uint32_t>& vertices, Albedo albedo) {
        const aiFace& face = mesh.mFaces[face_index];
        const auto place = [&] {
            return fmt::format("{}: mesh {}, face {}", name_, index, face_index);
        };
        // Points and lines that stand among triangles.
        if (face.mNumIndices < 3) return;
        for (unsigned i = 0; i < face.mNumIndices; ++i) {
            if (face.mIndices[i] < vertices.size()) continue;
            rules_.leave_out(fmt::format("vertex {} of {}; write the file again", face.mIndices[i],
                                         vertices.size()),
                             place);
            return;
        }
        rules_.count_face(face.mNumIndices, place);
        for (unsigned i = 0; i < face.mNumIndices; ++i)
            mesh_.faces.corners.push_back(vertices[face.mIndices[i]]);
        mesh_.faces.corner_counts.push_back(face.mNumIndices);
        mesh_.albedo.push_back(albedo);
    }

    Albedo albedo_of_material(unsigned index) const {
        aiColor3D colour;
        if (index >= scene_.mNumMaterials ||
            scene_.mMaterials[index]->Get(AI_MATKEY_COLOR_DIFFUSE, colour) != aiReturn_SUCCESS)
            return kDefaultAlbedo;
        if (!std::isfinite(colour.r) || !std::isfinite(colour.g) || !std::isfinite(colour.b))
            return kDefaultAlbedo;
        return albedo_of(colour.r, colour.g, colour.b);
    }

    const aiScene& scene_;
    const std::string& name_;
    MeshRules rules_;
    const MeshFileOptions& options_;
    std::unordered_map<PositionBits, std::uint32_t, PositionHash> vertices_;
    FileMesh mesh_;
};

}  // namespace

FileMesh mesh_of(const aiScene& scene, const std::string& name, const MeshFileOptions& options) {
    return Collector(scene, name, options).run();
}

}  // namespace mray::app
