// The textures of an OBJ file's faces.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <unordered_map>

#include "clips/obj/mtl_reader.h"
#include "clips/obj/obj_checker.h"
#include "clips/obj/obj_reader.h"
#include "clips/warning_count.h"

namespace mray {

/// Follows the materials of faces and fills FileMesh::textures, face_textures and texcoords. A
/// texture is searched where its library names it and, if it is not there or not in the folder of
/// the library, by its file name beside the library.
class ObjTextures {
public:
    /// `name` is the OBJ file in messages. Keeps references to all three.
    ObjTextures(const std::string& name, const CheckedObj& checked, FileMesh& mesh);

    /// Sets the material of the faces that follow.
    void use(const Material& material);
    /// Adds a face with these indices of CheckedObj::texcoords, whose corners the mesh has already
    /// and whose albedo it has not. Returns the albedo.
    Albedo add_face(std::span<const std::uint32_t> texcoords);
    /// Gives the warnings, once all faces have been added.
    void finish(const WarnFunction& warn);

private:
    std::uint32_t texture_of(const TextureMap& map);
    void begin(std::size_t corners);

    const std::string& name_;
    const CheckedObj& checked_;
    FileMesh& mesh_;
    Material material_;
    std::uint32_t texture_ = kNoTexture;
    std::unordered_map<std::string, std::uint32_t> found_;
    bool is_used_ = false;
    WarningCount missing_;
    WarningCount without_texcoords_;
};

}  // namespace mray
