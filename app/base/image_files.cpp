#include "app/base/image_files.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStdIO.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <png.h>
#include <turbojpeg.h>

#include <cassert>
#include <csetjmp>
#include <cstring>

#include "common/base/input_file.h"
#include "morphray/mesh.hpp"

namespace mray::app {
namespace {

void require_within(const ImageLimits& limits, const std::filesystem::path& path,
                    std::uint64_t width, std::uint64_t height) {
    if (std::max(width, height) <= limits.side && width * height <= limits.pixels) return;
    throw Error(
        ErrorKind::kLimit,
        "{}: has {}x{} pixels; at most {} a side and {} in all can be read, make it smaller",
        escape(path), width, height, limits.side, limits.pixels);
}

/// Throws std::bad_alloc if a decoder says so of memory. `format` is "PNG" or "JPEG".
[[noreturn]] void refuse_image(const std::filesystem::path& path, const char* format,
                               const std::string& what) {
    if (what.find("memory") != std::string::npos) throw std::bad_alloc();
    throw Error(ErrorKind::kBadInput,
                "{}: is not a {} file that can be read ({}); give another file", escape(path),
                format, what);
}

bool is_png(std::string_view bytes) { return bytes.starts_with("\x89PNG"); }

/// libpng leaves a failing call by longjmp, past destructors: what calls it has plain data alone.
class PngReader {
public:
    PngReader(const std::string& bytes, const std::filesystem::path& path)
        : path_(path), rest_(bytes) {
        png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, on_error, on_warning);
        if (png_ != nullptr) info_ = png_create_info_struct(png_);
        if (info_ == nullptr) {
            png_destroy_read_struct(&png_, &info_, nullptr);
            throw std::bad_alloc();
        }
    }
    ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
    PngReader(const PngReader&) = delete;
    PngReader& operator=(const PngReader&) = delete;

    void read_head() {
        if (setjmp(png_jmpbuf(png_)) != 0) refuse_image(path_, "PNG", error_);
        png_set_read_fn(png_, this, on_read);
        // Larger images are refused by their size, which the head says.
        png_set_user_limits(png_, 0x7FFFFFFF, 0x7FFFFFFF);
        // By default a text with a wrong checksum would be left out without an error.
        png_set_crc_action(png_, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
        png_read_info(png_, info_);
    }

    std::uint32_t width() const { return png_get_image_width(png_, info_); }
    std::uint32_t height() const { return png_get_image_height(png_, info_); }
    /// Reads 4 bytes a pixel, with a pointer to each row in `rows`.
    void read_pixels(png_bytepp rows) {
        if (setjmp(png_jmpbuf(png_)) != 0) refuse_image(path_, "PNG", error_);
        png_set_expand(png_);
        png_set_scale_16(png_);
        png_set_gray_to_rgb(png_);
        png_set_add_alpha(png_, 0xFF, PNG_FILLER_AFTER);
        png_set_interlace_handling(png_);
        png_read_update_info(png_, info_);
        png_read_image(png_, rows);
        png_read_end(png_, nullptr);
    }

private:
    [[noreturn]] static void on_error(png_structp png, png_const_charp message) {
        auto* const self = static_cast<PngReader*>(png_get_error_ptr(png));
        std::strncpy(self->error_, message, sizeof(self->error_) - 1);
        png_longjmp(png, 1);
    }
    static void on_warning(png_structp, png_const_charp) {}
    static void on_read(png_structp png, png_bytep out, std::size_t count) {
        std::string_view& rest = static_cast<PngReader*>(png_get_io_ptr(png))->rest_;
        if (count > rest.size()) png_error(png, "it ends too early");
        std::memcpy(out, rest.data(), count);
        rest.remove_prefix(count);
    }

    const std::filesystem::path& path_;
    std::string_view rest_;
    png_structp png_ = nullptr;
    png_infop info_ = nullptr;
    char error_[128] = {};
};

}  // namespace

Image decode_png(const std::string& bytes, const std::filesystem::path& path,
                 const ImageLimits& limits) {
    PngReader reader(bytes, path);
    reader.read_head();
    Image image{reader.width(), reader.height(), {}};
    require_within(limits, path, image.width, image.height);
    image.pixels.resize(std::size_t{image.width} * image.height);
    std::vector<png_bytep> rows;
    for (std::uint32_t y = 0; y < image.height; ++y)
        rows.push_back(
            reinterpret_cast<png_bytep>(image.pixels.data() + std::size_t{y} * image.width));
    reader.read_pixels(rows.data());
    return image;
}

Image decode_jpeg(const std::string& bytes, const std::filesystem::path& path,
                  const ImageLimits& limits) {
    // Other methods differ between versions. Damage would give grey pixels, and any number of
    // scans.
    constexpr int kFlags =
        TJFLAG_ACCURATEDCT | TJFLAG_FASTUPSAMPLE | TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS;
    const std::unique_ptr<void, int (*)(tjhandle)> reader(tjInitDecompress(), tjDestroy);
    if (reader == nullptr) throw std::bad_alloc();
    const auto* const data = reinterpret_cast<const unsigned char*>(bytes.data());
    int width = 0;
    int height = 0;
    int subsampling = 0;
    int colours = 0;
    if (tjDecompressHeader3(reader.get(), data, bytes.size(), &width, &height, &subsampling,
                            &colours) != 0)
        refuse_image(path, "JPEG", tjGetErrorStr2(reader.get()));
    if (colours == TJCS_CMYK || colours == TJCS_YCCK)
        refuse_image(path, "JPEG", "its colours are not grey, RGB or YCbCr; save as RGB");
    Image image{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), {}};
    require_within(limits, path, image.width, image.height);
    image.pixels.resize(std::size_t{image.width} * image.height);
    if (tjDecompress2(reader.get(), data, bytes.size(),
                      reinterpret_cast<unsigned char*>(image.pixels.data()), width, 0, height,
                      TJPF_RGBA, kFlags) != 0)
        refuse_image(path, "JPEG", tjGetErrorStr2(reader.get()));
    return image;
}

namespace {

// No image within the limits is larger, but for texts that it may have.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;

/// The name of an image in messages: "scene.gltf: images[0]" for a part of a file.
std::filesystem::path name_of(const TextureFile& file) {
    return file.place.empty() ? file.path : file.path + ": " + file.place;
}

std::string texture_bytes(const TextureFile& file) {
    if (file.content) return file.content->substr(file.offset, file.size);
    if (file.size == 0) return read_input_file(file.path, kMostBytes);
    const InputFile whole(file.path);
    std::string bytes(file.size, '\0');
    whole.read(file.offset, std::as_writable_bytes(std::span(bytes)));
    return bytes;
}

}  // namespace

Image read_texture(const TextureFile& file) {
    constexpr ImageLimits kLimits = {.side = morphray::kMaxTextureSide};
    const std::filesystem::path name = name_of(file);
    const std::string bytes = texture_bytes(file);
    if (is_png(bytes)) return decode_png(bytes, name, kLimits);
    if (bytes.starts_with("\xFF\xD8\xFF")) return decode_jpeg(bytes, name, kLimits);
    throw Error(ErrorKind::kBadInput, "{}: is neither a PNG nor a JPEG file; convert it",
                escape(name));
}

std::vector<Image> read_textures(const SceneTextures& textures, bool lenient,
                                 const Messages& messages) {
    std::vector<Image> images;
    for (const TextureFile& file : textures.files) {
        try {
            images.push_back(read_texture(file));
        } catch (const Error& error) {
            if (!lenient || error.kind() != ErrorKind::kBadInput) throw;
            Warning warning = as_warning(error, escape(file.path));
            warning.text += "; its faces have no texture";
            messages.warn(warning);
            images.push_back({1, 1, {0xFFFFFFFF}});
        }
    }
    return images;
}

std::string encode_exr(const morphray::Image& image, ExrColours colours,
                       std::span<const PngText> texts) {
    assert(image.linear.size() == image.pixels.size());
    Imf::Header header(static_cast<int>(image.width), static_cast<int>(image.height));
    header.compression() = Imf::ZIP_COMPRESSION;
    for (const PngText& text : texts) {
        std::string name = text.keyword;
        std::replace(name.begin(), name.end(), ' ', '_');
        header.insert(name, Imf::StringAttribute(text.text));
    }

    Imf::FrameBuffer buffer;
    std::vector<std::vector<std::byte>> planes;
    const auto add = [&](const std::string& name, const auto& value) {
        using Number = decltype(value(std::size_t{}));
        std::vector<std::byte>& plane = planes.emplace_back(image.pixels.size() * sizeof(Number));
        for (std::size_t i = 0; i < image.pixels.size(); ++i) {
            const Number number = value(i);
            std::memcpy(plane.data() + i * sizeof(Number), &number, sizeof(Number));
        }
        constexpr Imf::PixelType kType = std::is_same_v<Number, half> ? Imf::HALF : Imf::FLOAT;
        header.channels().insert(name, Imf::Channel(kType));
        buffer.insert(name, Imf::Slice(kType, reinterpret_cast<char*>(plane.data()), sizeof(Number),
                                       sizeof(Number) * image.width));
    };
    for (std::size_t k = 0; k < 3; ++k) {
        const auto colour = [&](std::size_t i) { return image.linear[i][k]; };
        const std::string colour_name(1, "RGB"[k]);
        if (colours == ExrColours::kFloat)
            add(colour_name, colour);
        else
            add(colour_name, [&](std::size_t i) { return half(colour(i)); });
    }
    const std::size_t side = morphray::sample_side(image.samples);
    add("depth.Z", [&](std::size_t i) {
        // The sample in the middle of the pixel.
        const std::size_t x = i % image.width * side + side / 2;
        const std::size_t y = i / image.width * side + side / 2;
        const morphray::Hit& hit = image.hits[y * image.width * side + x];
        return hit ? hit.t : std::numeric_limits<float>::infinity();
    });
    Imf::StdOSStream stream;
    {
        Imf::OutputFile file(stream, header);
        file.setFrameBuffer(buffer);
        file.writePixels(header.dataWindow().max.y + 1);
    }
    return stream.str();
}

}  // namespace mray::app
