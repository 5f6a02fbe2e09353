#include "app/files/image_files.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStdIO.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <cassert>
#include <cstring>
#include <limits>
#include <list>
#include <string>

namespace mray::app {
namespace {

constexpr Imf::PixelType type_of(float) { return Imf::FLOAT; }
constexpr Imf::PixelType type_of(unsigned) { return Imf::UINT; }
Imf::PixelType type_of(half) { return Imf::HALF; }

/// Names and planes of the channels of a file; planes stay where they are.
class Channels {
public:
    Channels(Imf::Header& header, const morphray::Image& image) : header_(header), image_(image) {}

    template <class T, class Value>
    void add(const std::string& name, Value value) {
        std::vector<std::byte>& plane = planes_.emplace_back(image_.pixels.size() * sizeof(T));
        for (std::size_t i = 0; i < image_.pixels.size(); ++i) {
            const T number = static_cast<T>(value(i));
            std::memcpy(plane.data() + i * sizeof(T), &number, sizeof(T));
        }
        header_.channels().insert(name, Imf::Channel(type_of(T())));
        char* const base = reinterpret_cast<char*>(plane.data());
        buffer_.insert(name, Imf::Slice(type_of(T()), base, sizeof(T), sizeof(T) * image_.width));
    }
    const Imf::FrameBuffer& buffer() const { return buffer_; }

private:
    Imf::Header& header_;
    const morphray::Image& image_;
    Imf::FrameBuffer buffer_;
    std::list<std::vector<std::byte>> planes_;
};

/// The hit of the sample in the middle of each pixel.
std::vector<morphray::Hit> middle_hits(const morphray::Image& image) {
    const std::size_t side = morphray::sample_side(image.samples);
    std::vector<morphray::Hit> hits(image.pixels.size());
    for (std::size_t i = 0; i < hits.size(); ++i) {
        const std::size_t x = i % image.width * side + side / 2;
        const std::size_t y = i / image.width * side + side / 2;
        hits[i] = image.hits[y * image.width * side + x];
    }
    return hits;
}

std::vector<std::byte> write(const Imf::Header& header, const Channels& channels) {
    Imf::StdOSStream stream;
    {
        Imf::OutputFile file(stream, header);
        file.setFrameBuffer(channels.buffer());
        file.writePixels(header.dataWindow().max.y + 1);
    }
    const std::string file = stream.str();
    const auto* bytes = reinterpret_cast<const std::byte*>(file.data());
    return {bytes, bytes + file.size()};
}

}  // namespace

std::vector<std::byte> encode_exr(const morphray::Image& image, ExrColours colours,
                                  std::span<const PngText> texts) {
    assert(image.lit_pixels.size() == image.pixels.size());
    Imf::Header header(static_cast<int>(image.width), static_cast<int>(image.height));
    header.compression() = Imf::ZIP_COMPRESSION;
    for (const PngText& text : texts) {
        std::string name = text.keyword;
        std::replace(name.begin(), name.end(), ' ', '_');
        header.insert(name, Imf::StringAttribute(text.text));
    }

    Channels channels(header, image);
    for (std::size_t k = 0; k < 3; ++k) {
        const auto colour = [&](std::size_t i) { return image.lit_pixels[i].colour[k]; };
        const std::string colour_name(1, "RGB"[k]);
        if (colours == ExrColours::kFloat)
            channels.add<float>(colour_name, colour);
        else
            channels.add<half>(colour_name, colour);
        channels.add<half>(std::string("normal.") + "XYZ"[k],
                           [&](std::size_t i) { return image.lit_pixels[i].normal[k]; });
    }
    channels.add<half>("occlusion.Y", [&](std::size_t i) { return 1 - image.lit_pixels[i].open; });
    const std::vector<morphray::Hit> hits = middle_hits(image);
    channels.add<float>("depth.Z", [&](std::size_t i) {
        return hits[i] ? hits[i].t : std::numeric_limits<float>::infinity();
    });
    channels.add<float>("barycentric.U", [&](std::size_t i) { return hits[i].u; });
    channels.add<float>("barycentric.V", [&](std::size_t i) { return hits[i].v; });
    channels.add<unsigned>("id.prim", [&](std::size_t i) { return hits[i].prim_id; });
    channels.add<unsigned>("id.geom", [&](std::size_t i) { return hits[i].geom_id; });
    return write(header, channels);
}

}  // namespace mray::app
