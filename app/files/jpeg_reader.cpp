// The only file of the program that includes libjpeg-turbo.
#include "app/files/image_files.h"

#include <fmt/format.h>
#include <turbojpeg.h>

#include <memory>

#include "common/base/errors.h"
#include "common/text/text.h"

namespace mray::app {
namespace {

// The most pixels a byte: a Huffman code of one bit, for 8x8 values of one for 4x4 pixels each.
constexpr std::uint64_t kMostPixelsPerByte = 8 * 32 * 32;
// Other methods differ between versions. Damage would give grey pixels, and any number of scans.
constexpr int kFlags =
    TJFLAG_ACCURATEDCT | TJFLAG_FASTUPSAMPLE | TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS;

}  // namespace

bool is_jpeg(std::string_view bytes) { return bytes.starts_with("\xFF\xD8\xFF"); }

Image decode_jpeg(const std::string& bytes, const std::filesystem::path& path,
                  const ImageLimits& limits) {
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
    limits.require(path, image.width, image.height);
    const std::uint64_t pixels = std::uint64_t{image.width} * image.height;
    if (pixels / kMostPixelsPerByte > bytes.size()) refuse_image(path, "JPEG", "it ends too early");
    image.pixels.resize(pixels);
    if (tjDecompress2(reader.get(), data, bytes.size(),
                      reinterpret_cast<unsigned char*>(image.pixels.data()), width, 0, height,
                      TJPF_RGBA, kFlags) != 0)
        refuse_image(path, "JPEG", tjGetErrorStr2(reader.get()));
    return image;
}

}  // namespace mray::app
