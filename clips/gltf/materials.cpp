#include "clips/gltf/materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "clips/gltf/file/uri.h"
#include "clips/obj/mtl_reader.h"
#include "clips/warning_count.h"
#include "common/base/errors.h"

namespace mray::gltf {
namespace {

constexpr std::uint64_t kClampToEdge = 33071;
constexpr std::uint64_t kMirroredRepeat = 33648;
constexpr std::uint64_t kRepeat = 10497;

class MaterialReader {
public:
    MaterialReader(const GltfFile& file, Materials& result) : file_(file), result_(result) {}

    void read(const JsonAt& at) {
        Material& material = result_.materials.emplace_back();
        const auto metal = at.find("pbrMetallicRoughness");
        if (!metal) return;
        std::array<double, 4> factor = {1, 1, 1, 1};
        if (const auto given = metal->find("baseColorFactor")) given->numbers(factor);
        material.albedo = albedo_of(static_cast<float>(factor[0]), static_cast<float>(factor[1]),
                                    static_cast<float>(factor[2]));
        const auto info = metal->find("baseColorTexture");
        if (!info) return;
        material.texture = texture_of(info->at("index"));
        constexpr std::uint64_t kMostSets = 1000;
        material.texcoord_set =
            static_cast<std::uint32_t>(std::min(info->count_or("texCoord", 0), kMostSets));
        const auto extensions = info->find("extensions");
        if (extensions && extensions->find("KHR_texture_transform"))
            warn(*extensions, "KHR_texture_transform is not read; ignored");
    }

    void tell(const WarnFunction& warn) const { odd_.tell(warn); }

private:
    void warn(const JsonAt& at, const std::string& what) {
        odd_.add([&] { return Warning{file_.name(), fmt::format("{}: {}", at.path(), what)}; });
    }

    std::uint32_t texture_of(const JsonAt& reference) {
        const JsonAt texture =
            file_.element("textures", reference.index_below(file_.count("textures"), "textures"));
        const auto source = texture.index_or_none("source", file_.count("images"), "images");
        if (!source) {
            warn(texture, "has no image that is read; its triangles have their colour alone");
            return kNoTexture;
        }
        const auto [known, is_new] = known_.try_emplace({*source, is_clamped(texture)}, kNoTexture);
        TextureFile image;
        if (!is_new || !find_image(file_.element("images", *source), image)) return known->second;
        image.clamp = known->first.second;
        known->second = static_cast<std::uint32_t>(result_.textures.size());
        result_.textures.push_back(image);
        return known->second;
    }

    bool is_clamped(const JsonAt& texture) {
        const auto index = texture.index_or_none("sampler", file_.count("samplers"), "samplers");
        if (!index) return false;
        const JsonAt sampler = file_.element("samplers", *index);
        const std::uint64_t s = sampler.count_or("wrapS", kRepeat);
        const std::uint64_t t = sampler.count_or("wrapT", kRepeat);
        if (s != t) warn(sampler, "wraps differently along s and t; t is taken as s");
        if (s == kMirroredRepeat) warn(sampler, "repeats mirrored; taken as repeated");
        return s == kClampToEdge;
    }

    bool find_image(const JsonAt& image, TextureFile& found) {
        constexpr const char* kLeftOut = "; its triangles have their colour alone";
        if (const auto uri = image.find("uri")) {
            if (uri->text().starts_with("data:")) {
                warn(*uri,
                     fmt::format("is an image in a data: URI, which is not read{}", kLeftOut));
                return false;
            }
            try {
                found.path = file_of_uri(*uri, file_.path()).native();
            } catch (const Error& error) {
                if (error.kind() != ErrorKind::kBadInput) throw;
                const std::string text = as_warning(error, file_.name()).text;
                odd_.add([&] { return Warning{file_.name(), text + kLeftOut}; });
                return false;
            }
            return true;
        }
        return find_in_buffer(image, found);
    }

    bool find_in_buffer(const JsonAt& image, TextureFile& found) {
        const JsonAt view = file_.element(
            "bufferViews",
            image.at("bufferView").index_below(file_.count("bufferViews"), "buffer views"));
        const Buffer& buffer =
            file_.buffers()[view.at("buffer").index_below(file_.buffers().size(), "buffers")];
        const std::uint64_t offset = view.count_or("byteOffset", 0);
        const std::uint64_t length = view.at("byteLength").count();
        if (length > buffer.bytes.size() || offset > buffer.bytes.size() - length)
            view.fail(fmt::format("bytes {} to {} are not in the buffer, which has {}", offset,
                                  offset + length, buffer.bytes.size()));
        if (buffer.file.empty() || length == 0) {
            warn(image,
                 "is an image in a data: URI, which is not read; its triangles have their "
                 "colour alone");
            return false;
        }
        found.path = buffer.file.native();
        found.offset = buffer.offset_in_file + offset;
        found.size = length;
        return true;
    }

    const GltfFile& file_;
    Materials& result_;
    /// Textures by image and whether they are clamped.
    std::map<std::pair<std::uint32_t, bool>, std::uint32_t> known_;
    WarningCount odd_;
};

}  // namespace

TexcoordSets Materials::texcoord_sets() const {
    TexcoordSets sets;
    for (const Material& material : materials) {
        sets.push_back(material.texture == kNoTexture ? std::nullopt
                                                      : std::optional(material.texcoord_set));
    }
    return sets;
}

Materials read_materials(const GltfFile& file, const ClipOptions& options) {
    Materials result;
    MaterialReader reader(file, result);
    const std::size_t count = file.count("materials");
    for (std::size_t i = 0; i < count; ++i) reader.read(file.element("materials", i));
    reader.tell(options.warn);
    return result;
}

}  // namespace mray::gltf
