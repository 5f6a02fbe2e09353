#include "scenes/gltf/gltf_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>

#include "common/base/errors.h"
#include "scenes/trig.h"

namespace mray::gltf {
namespace {

constexpr std::uint64_t kClampToEdge = 33071;
constexpr std::uint64_t kMirroredRepeat = 33648;
constexpr std::uint64_t kRepeat = 10497;

TexcoordUse texcoords_of(const JsonAt& info) {
    const auto set_of = [](const JsonAt& at, std::uint64_t otherwise) {
        constexpr std::uint64_t kMostSets = 1000;
        return static_cast<std::uint32_t>(std::min(at.count_or("texCoord", otherwise), kMostSets));
    };
    TexcoordUse use = {.set = set_of(info, 0)};
    const auto transform = extension_of(info, kTextureTransform);
    if (!transform) return use;
    use.set = set_of(*transform, use.set);
    std::array<double, 2> offset = {0, 0};
    std::array<double, 2> scale = {1, 1};
    transform->numbers_of("offset", offset);
    transform->numbers_of("scale", scale);
    const auto rotation = transform->find("rotation");
    constexpr double kTurn = 6.283185307179586476925;
    const CosSin turned = circle_point(rotation ? rotation->number() / kTurn : 0);
    // Counterclockwise as the image is seen: v goes downwards.
    use.map = {.u = {turned.cos * scale[0], turned.sin * scale[1], offset[0]},
               .v = {-turned.sin * scale[0], turned.cos * scale[1], offset[1]}};
    return use;
}

class MaterialReader {
public:
    MaterialReader(const GltfFile& file, Materials& result) : file_(file), result_(result) {}

    void read(const JsonAt& at) {
        Material& material = result_.materials.emplace_back();
        odd_.catch_fault(file_.name(), "; its triangles have their colour alone",
                         [&] { read(at, material); });
    }

    void tell(const WarnFunction& warn) const {
        odd_.tell(warn);
        blends_.tell(warn);
    }

private:
    void read(const JsonAt& at, Material& material) {
        const auto base = at.find("pbrMetallicRoughness");
        const auto texture = base ? base->find("baseColorTexture") : std::nullopt;
        std::array<double, 4> factor = {1, 1, 1, 1};
        if (base) base->numbers_of("baseColorFactor", factor);
        material.albedo = albedo_of(static_cast<float>(factor[0]), static_cast<float>(factor[1]),
                                    static_cast<float>(factor[2]));
        const double cutoff = alpha_cutoff_of(at);
        material.is_cut_away = factor[3] < cutoff;
        if (!texture || material.is_cut_away) return;
        material.texcoords = texcoords_of(*texture);
        // The factor is above 0 where the cutoff is.
        material.texture = texture_of(texture->at("index"),
                                      cutoff == 0 ? 0 : static_cast<float>(cutoff / factor[3]));
    }

    void warn(const JsonAt& at, const std::string& what) {
        odd_.add([&] { return Warning{file_.name(), fmt::format("{}: {}", at.path(), what)}; });
    }

    /// From where on a material is opaque; 0: everywhere.
    double alpha_cutoff_of(const JsonAt& material) {
        const auto mode = material.find("alphaMode");
        if (mode && mode->text() == "BLEND") {
            blends_.add([&] {
                return Warning{file_.name(), mode->path() + ": is BLEND; shown opaque"};
            });
        }
        if (!mode || mode->text() != "MASK") return 0;
        const auto cutoff = material.find("alphaCutoff");
        return cutoff ? std::max(cutoff->number(), 0.0) : 0.5;
    }

    std::uint32_t texture_of(const JsonAt& reference, float alpha_cutoff) {
        const JsonAt texture =
            file_.element("textures", reference.index_below(file_.count("textures"), "textures"));
        const auto source = texture.index_or_none("source", file_.count("images"), "images");
        if (!source) texture.fail("has no image that is read");
        const bool clamp = is_clamped(texture);
        const auto [known, is_new] = known_.try_emplace({*source, clamp, alpha_cutoff}, kNoTexture);
        if (!is_new) return known->second;
        const std::optional<TextureFile>& image = image_of(*source);
        if (!image) return kNoTexture;
        known->second = static_cast<std::uint32_t>(result_.textures.size());
        result_.textures.push_back(*image);
        result_.textures.back().clamp = clamp;
        result_.textures.back().alpha_cutoff = alpha_cutoff;
        return known->second;
    }

    const std::optional<TextureFile>& image_of(std::uint32_t source) {
        const auto [known, is_new] = images_.try_emplace(source);
        if (is_new) known->second = find_image(file_.element("images", source));
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

    TextureFile find_image(const JsonAt& image) {
        const auto uri = image.find("uri");
        if (!uri) return find_in_buffer(image);
        std::optional<std::string> data = data_of_uri(*uri);
        if (!data) return {.path = file_of_uri(*uri, file_.path()).native()};
        if (data->empty()) uri->fail("has no bytes");
        return {.path = file_.path().native(),
                .size = data->size(),
                .place = uri->path(),
                .content = std::make_shared<const std::string>(std::move(*data))};
    }

    TextureFile find_in_buffer(const JsonAt& image) {
        const View view = file_.view(image.at("bufferView"));
        if (view.bytes.empty()) image.fail("has no bytes");
        const Buffer& buffer = view.buffer;
        return TextureFile{.path = (buffer.data ? file_.path() : buffer.file).native(),
                           .offset = buffer.offset_in_file + view.offset,
                           .size = view.bytes.size(),
                           .place = image.path(),
                           .content = buffer.data};
    }

    const GltfFile& file_;
    Materials& result_;
    /// Textures by image, whether they are clamped, and where alpha makes holes.
    std::map<std::tuple<std::uint32_t, bool, float>, std::uint32_t> known_;
    /// Those that are used, by their indices; nothing for those that are left out.
    std::map<std::uint32_t, std::optional<TextureFile>> images_;
    WarningCount odd_;
    WarningCount blends_;
};

}  // namespace

Materials read_materials(const GltfFile& file, const AnimationOptions& options) {
    Materials result;
    MaterialReader reader(file, result);
    const std::size_t count = file.count("materials");
    for (std::size_t i = 0; i < count; ++i) reader.read(file.element("materials", i));
    reader.tell(options.warn);
    return result;
}

}  // namespace mray::gltf
