// The only file of the program that includes libjpeg-turbo.
#include "app/files/image_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <iterator>

#include <jpeglib.h>
// After jpeglib.h.
#include <jerror.h>

#include "common/base/errors.h"
#include "common/text/text_parts.h"

namespace mray::app {
namespace {

// A progressive file may repeat scans without end, each of which takes time for the whole image.
constexpr int kMostScans = 200;
// Pixels that a byte stands for at most: a Huffman code has a bit at least, for a block of 8x8
// values of a channel that has one for 4x4 pixels at least. Arithmetic codes have no such limit.
constexpr std::uint64_t kMostPixelsPerByte = 8 * 32 * 32;

/// A decoder of bytes in memory. libjpeg leaves a call that fails by longjmp, which runs no
/// destructors: each function that calls it has plain data alone.
class JpegReader {
public:
    JpegReader() {
        jpeg_.err = jpeg_std_error(&errors_);
        errors_.error_exit = on_error;
        errors_.emit_message = on_message;
        progress_.progress_monitor = on_progress;
        jpeg_.client_data = this;
    }
    ~JpegReader() { jpeg_destroy_decompress(&jpeg_); }
    JpegReader(const JpegReader&) = delete;
    JpegReader& operator=(const JpegReader&) = delete;

    /// Returns whether the head could be read; otherwise error() says why not.
    bool read_head(const unsigned char* bytes, unsigned long size) {
        if (setjmp(failed_) != 0) return false;
        jpeg_create_decompress(&jpeg_);
        jpeg_.progress = &progress_;
        jpeg_mem_src(&jpeg_, bytes, size);
        jpeg_read_header(&jpeg_, TRUE);
        return true;
    }

    std::uint32_t width() const { return jpeg_.image_width; }
    std::uint32_t height() const { return jpeg_.image_height; }
    bool is_arithmetic() const { return jpeg_.arith_code != 0; }
    bool is_rgb_or_grey() const {
        return jpeg_.jpeg_color_space == JCS_GRAYSCALE || jpeg_.jpeg_color_space == JCS_RGB ||
               jpeg_.jpeg_color_space == JCS_YCbCr;
    }

    /// Reads 4 bytes a pixel, row by row.
    bool read_pixels(unsigned char* pixels) {
        if (setjmp(failed_) != 0) return false;
        jpeg_.out_color_space = JCS_EXT_RGBA;
        // Versions of the library differ in other methods, and some of those in rounding.
        jpeg_.dct_method = JDCT_ISLOW;
        jpeg_.do_fancy_upsampling = FALSE;
        jpeg_.do_block_smoothing = FALSE;
        jpeg_start_decompress(&jpeg_);
        while (jpeg_.output_scanline < jpeg_.output_height) {
            JSAMPROW row = pixels + std::size_t{4} * jpeg_.output_width * jpeg_.output_scanline;
            jpeg_read_scanlines(&jpeg_, &row, 1);
        }
        jpeg_finish_decompress(&jpeg_);
        return true;
    }

    const char* error() const { return error_; }

private:
    static JpegReader& self(j_common_ptr jpeg) {
        return *static_cast<JpegReader*>(jpeg->client_data);
    }
    [[noreturn]] static void on_error(j_common_ptr jpeg) {
        char message[JMSG_LENGTH_MAX];
        jpeg->err->format_message(jpeg, message);
        std::snprintf(self(jpeg).error_, sizeof(error_), "%s", message);
        std::longjmp(self(jpeg).failed_, 1);
    }
    /// libjpeg goes on after damage with grey pixels and a warning; this does not.
    static void on_message(j_common_ptr jpeg, int level) {
        constexpr int kHarmless[] = {JWRN_ADOBE_XFORM, JWRN_BOGUS_PROGRESSION, JWRN_EXTRANEOUS_DATA,
                                     JWRN_JFIF_MAJOR};
        if (level >= 0) return;  // a trace
        const auto* const end = std::end(kHarmless);
        if (std::find(std::begin(kHarmless), end, jpeg->err->msg_code) == end) on_error(jpeg);
    }
    static void on_progress(j_common_ptr jpeg) {
        const auto* const decoder = reinterpret_cast<j_decompress_ptr>(jpeg);
        if (decoder->input_scan_number <= kMostScans) return;
        std::snprintf(self(jpeg).error_, sizeof(error_), "it has more than %d scans", kMostScans);
        std::longjmp(self(jpeg).failed_, 1);
    }

    jpeg_decompress_struct jpeg_ = {};
    jpeg_error_mgr errors_ = {};
    jpeg_progress_mgr progress_ = {};
    std::jmp_buf failed_ = {};
    char error_[JMSG_LENGTH_MAX + 1] = {};
};

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& what) {
    throw Error(ErrorKind::kBadInput, fmt::format("{}: is not a JPEG file that can be read ({}); "
                                                  "give another file",
                                                  escape(path), what));
}

}  // namespace

bool is_jpeg(std::string_view bytes) { return bytes.starts_with("\xFF\xD8\xFF"); }

Image decode_jpeg(const std::string& bytes, const std::filesystem::path& path,
                  const ImageLimits& limits) {
    JpegReader reader;
    if (!reader.read_head(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()))
        refuse(path, reader.error());
    if (!reader.is_rgb_or_grey())
        refuse(path, "its colours are not grey, RGB or YCbCr; save as RGB");
    Image image{reader.width(), reader.height(), {}};
    limits.require(path, image.width, image.height);
    const std::uint64_t pixels = std::uint64_t{image.width} * image.height;
    if (!reader.is_arithmetic() && pixels / kMostPixelsPerByte > bytes.size())
        refuse(path, "it ends too early");
    image.pixels.resize(pixels);
    if (!reader.read_pixels(reinterpret_cast<unsigned char*>(image.pixels.data())))
        refuse(path, reader.error());
    return image;
}

}  // namespace mray::app
