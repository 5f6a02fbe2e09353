// The only file of the program that includes libpng.
#include "app/files/image_files.h"

#include <fmt/format.h>
#include <png.h>

#include <csetjmp>
#include <cstring>
#include <string>
#include <vector>

#include "common/base/errors.h"
#include "common/text/text.h"

namespace mray::app {
namespace {

// Deflate expands a byte to at most 1032.
constexpr std::uint64_t kMostCompression = 1032;

/// libpng leaves a failing call by longjmp, past destructors: what calls it has plain data alone.
class PngReader {
public:
    explicit PngReader(const std::string& bytes) : rest_(bytes.data()), left_(bytes.size()) {
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

    /// Returns whether the head could be read; otherwise error() says why not.
    bool read_head() {
        if (setjmp(png_jmpbuf(png_)) != 0) return false;
        png_set_read_fn(png_, this, on_read);
        // Larger images are refused by their size, which the head says.
        png_set_user_limits(png_, 0x7FFFFFFF, 0x7FFFFFFF);
        // By default a text with a wrong checksum would be left out without an error.
        png_set_crc_action(png_, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
        png_read_info(png_, info_);
        return true;
    }

    std::uint32_t width() const { return png_get_image_width(png_, info_); }
    std::uint32_t height() const { return png_get_image_height(png_, info_); }
    /// The bytes of all rows, without compression.
    std::uint64_t stored_bytes() const {
        return std::uint64_t{png_get_rowbytes(png_, info_)} * height();
    }

    /// Reads 4 bytes a pixel into `pixels`, with a pointer to each row in `rows`.
    bool read_pixels(png_bytepp rows) {
        if (setjmp(png_jmpbuf(png_)) != 0) return false;
        png_set_expand(png_);
        png_set_scale_16(png_);
        png_set_gray_to_rgb(png_);
        png_set_add_alpha(png_, 0xFF, PNG_FILLER_AFTER);
        png_set_interlace_handling(png_);
        png_read_update_info(png_, info_);
        png_read_image(png_, rows);
        png_read_end(png_, nullptr);
        return true;
    }

    const char* error() const { return error_; }

private:
    [[noreturn]] static void on_error(png_structp png, png_const_charp message) {
        auto* const self = static_cast<PngReader*>(png_get_error_ptr(png));
        std::strncpy(self->error_, message, sizeof(self->error_) - 1);
        png_longjmp(png, 1);
    }
    static void on_warning(png_structp, png_const_charp) {}
    static void on_read(png_structp png, png_bytep out, std::size_t count) {
        auto* const self = static_cast<PngReader*>(png_get_io_ptr(png));
        if (count > self->left_) png_error(png, "it ends too early");
        std::memcpy(out, self->rest_, count);
        self->rest_ += count;
        self->left_ -= count;
    }

    png_structp png_ = nullptr;
    png_infop info_ = nullptr;
    const char* rest_;
    std::size_t left_;
    char error_[128] = {};
};

/// Returns true if a chunk claims more bytes than the file has, which libpng would allocate.
bool is_cut(std::string_view bytes) {
    constexpr std::size_t kSignature = 8;
    constexpr std::size_t kFrame = 12;  // length, type, checksum
    for (std::size_t at = kSignature; at < bytes.size();) {
        const std::string_view rest = bytes.substr(at);
        if (rest.size() < kFrame) return true;
        std::uint32_t length = 0;
        for (std::size_t i = 0; i < 4; ++i)
            length = length << 8 | static_cast<unsigned char>(rest[i]);
        if (length > rest.size() - kFrame) return true;
        if (rest.substr(4, 4) == "IEND") return false;
        at += kFrame + length;
    }
    return true;
}

}  // namespace

bool is_png(std::string_view bytes) { return bytes.starts_with("\x89PNG"); }

Image decode_png(const std::string& bytes, const std::filesystem::path& path,
                 const ImageLimits& limits) {
    if (is_png(bytes) && is_cut(bytes)) refuse_image(path, "PNG", "it ends too early");
    PngReader reader(bytes);
    if (!reader.read_head()) refuse_image(path, "PNG", reader.error());
    Image image{reader.width(), reader.height(), {}};
    // libpng takes a few rows.
    limits.require(path, image.width, image.height);
    if (reader.stored_bytes() / kMostCompression > bytes.size())
        refuse_image(path, "PNG", "it ends too early");
    image.pixels.resize(std::size_t{image.width} * image.height);
    std::vector<png_bytep> rows;
    for (std::uint32_t y = 0; y < image.height; ++y)
        rows.push_back(
            reinterpret_cast<png_bytep>(image.pixels.data() + std::size_t{y} * image.width));
    if (!reader.read_pixels(rows.data())) refuse_image(path, "PNG", reader.error());
    return image;
}

}  // namespace mray::app
