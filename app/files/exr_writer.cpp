#include "app/files/image_files.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>

namespace mray::app {
namespace {

/// A file in memory.
class MemoryStream : public Imf::OStream {
public:
    MemoryStream() : Imf::OStream("memory") {}

    void write(const char bytes[], int count) override {
        const auto size = static_cast<std::size_t>(count);
        if (bytes_.size() < at_ + size) bytes_.resize(at_ + size);
        std::memcpy(bytes_.data() + at_, bytes, size);
        at_ += size;
    }
    std::uint64_t tellp() override { return at_; }
    void seekp(std::uint64_t at) override { at_ = static_cast<std::size_t>(at); }

    std::vector<std::byte> take() { return std::move(bytes_); }

private:
    std::vector<std::byte> bytes_;
    std::size_t at_ = 0;
};

/// Names and planes of the channels of a file; planes stay where they are.
class Channels {
public:
    Channels(Imf::Header& header, std::size_t width) : header_(header), width_(width) {}

    template <class T>
    void add(const char* name, Imf::PixelType type, const std::vector<T>& plane) {
        header_.channels().insert(name, Imf::Channel(type));
        char* const base = const_cast<char*>(reinterpret_cast<const char*>(plane.data()));
        buffer_.insert(name, Imf::Slice(type, base, sizeof(T), sizeof(T) * width_));
    }
    const Imf::FrameBuffer& buffer() const { return buffer_; }

private:
    Imf::Header& header_;
    std::size_t width_;
    Imf::FrameBuffer buffer_;
};

template <class T, class Value>
std::vector<T> plane_of(std::size_t count, Value value) {
    std::vector<T> plane(count);
    for (std::size_t i = 0; i < count; ++i) plane[i] = static_cast<T>(value(i));
    return plane;
}

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

/// Writes the file, whose channels are complete.
std::vector<std::byte> write(const Imf::Header& header, const Channels& channels) {
    MemoryStream stream;
    {
        Imf::OutputFile file(stream, header);
        file.setFrameBuffer(channels.buffer());
        file.writePixels(header.dataWindow().max.y + 1);
    }
    return stream.take();
}

}  // namespace

std::vector<std::byte> encode_exr(const morphray::Image& image, ExrColours colours,
                                  std::span<const PngText> texts) {
    assert(image.lit_pixels.size() == image.pixels.size());
    const std::size_t count = image.pixels.size();
    Imf::Header header(static_cast<int>(image.width), static_cast<int>(image.height));
    header.compression() = Imf::ZIP_COMPRESSION;
    for (const PngText& text : texts) {
        std::string name = text.keyword;
        std::replace(name.begin(), name.end(), ' ', '_');
        header.insert(name, Imf::StringAttribute(text.text));
    }

    Channels channels(header, image.width);
    const char* const kColours[] = {"R", "G", "B"};
    std::vector<float> floats[3];
    std::vector<half> halves[3];
    for (std::size_t k = 0; k < 3; ++k) {
        const auto value = [&](std::size_t i) { return image.lit_pixels[i].colour[k]; };
        if (colours == ExrColours::kFloat) {
            floats[k] = plane_of<float>(count, value);
            channels.add(kColours[k], Imf::FLOAT, floats[k]);
        } else {
            halves[k] = plane_of<half>(count, value);
            channels.add(kColours[k], Imf::HALF, halves[k]);
        }
    }
    const char* const kNormals[] = {"normal.X", "normal.Y", "normal.Z"};
    std::vector<half> normals[3];
    for (std::size_t k = 0; k < 3; ++k) {
        normals[k] =
            plane_of<half>(count, [&](std::size_t i) { return image.lit_pixels[i].normal[k]; });
        channels.add(kNormals[k], Imf::HALF, normals[k]);
    }
    const std::vector<half> hidden =
        plane_of<half>(count, [&](std::size_t i) { return 1 - image.lit_pixels[i].open; });
    channels.add("occlusion.Y", Imf::HALF, hidden);

    const std::vector<morphray::Hit> hits = middle_hits(image);
    const auto depth = plane_of<float>(count, [&](std::size_t i) {
        return hits[i] ? hits[i].t : std::numeric_limits<float>::infinity();
    });
    const auto u = plane_of<float>(count, [&](std::size_t i) { return hits[i].u; });
    const auto v = plane_of<float>(count, [&](std::size_t i) { return hits[i].v; });
    const auto prim = plane_of<unsigned>(count, [&](std::size_t i) { return hits[i].prim_id; });
    const auto geom = plane_of<unsigned>(count, [&](std::size_t i) { return hits[i].geom_id; });
    channels.add("depth.Z", Imf::FLOAT, depth);
    channels.add("barycentric.U", Imf::FLOAT, u);
    channels.add("barycentric.V", Imf::FLOAT, v);
    channels.add("id.prim", Imf::UINT, prim);
    channels.add("id.geom", Imf::UINT, geom);
    return write(header, channels);
}

}  // namespace mray::app
