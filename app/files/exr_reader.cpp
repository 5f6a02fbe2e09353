#include "app/files/exr_reader.h"

#include <fmt/format.h>

#include <Iex.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstring>
#include <new>
#include <optional>
#include <string_view>
#include <utility>

#include "app/base/memory_budget.h"
#include "app/files/image_limits.h"
#include "common/base/errors.h"
#include "common/base/input_file.h"
#include "common/text/ascii.h"
#include "common/text/message_text.h"

namespace mray::app {
namespace {

constexpr std::uint64_t kMostSide = 65536;
constexpr std::uint64_t kMostPixels = std::uint64_t{1} << 28;
constexpr std::size_t kMostChannels = 64;
// Rows that one block of the compressions of OpenEXR has at most.
constexpr std::uint64_t kMostRowsOfBlock = 256;

/// Bytes in memory; a read beyond their end throws.
class MemoryStream : public Imf::IStream {
public:
    MemoryStream(const std::string& name, std::string bytes)
        : Imf::IStream(name.c_str()), bytes_(std::move(bytes)) {}

    bool read(char out[], int count) override {
        const auto size = static_cast<std::size_t>(count);
        if (at_ > bytes_.size() || size > bytes_.size() - at_)
            throw Iex::InputExc("it ends too early");
        std::memcpy(out, bytes_.data() + at_, size);
        at_ += size;
        return at_ < bytes_.size();
    }
    std::uint64_t tellg() override { return at_; }
    void seekg(std::uint64_t at) override { at_ = at; }

private:
    std::string bytes_;
    std::uint64_t at_ = 0;
};

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& what) {
    throw Error(ErrorKind::kBadInput,
                fmt::format("{}: is not an OpenEXR file that can be read ({}); give another file",
                            shown(path), what));
}

/// The 4 bytes at `at` as a little-endian number; refuses a file that ends before.
std::uint32_t number_at(const std::filesystem::path& path, std::string_view bytes, std::size_t at) {
    std::uint32_t number = 0;
    if (at > bytes.size() || bytes.size() - at < 4) refuse(path, "it ends too early");
    for (std::size_t i = 4; i-- > 0;)
        number = number << 8 | static_cast<unsigned char>(bytes[at + i]);
    return number;
}

struct TypeSize {
    std::string_view type;
    std::uint32_t bytes;
};
// OpenEXR reads a fixed number of bytes for these types. It ignores the size in the file and would
// misread what follows.
constexpr auto kTypeSizes = std::to_array<TypeSize>({
    {"box2f", 16},         {"box2i", 16},    {"chromaticities", 32},
    {"compression", 1},    {"double", 8},    {"envmap", 1},
    {"deepImageState", 1}, {"float", 4},     {"int", 4},
    {"keycode", 28},       {"lineOrder", 1}, {"m33d", 72},
    {"m33f", 36},          {"m44d", 128},    {"m44f", 64},
    {"rational", 8},       {"tiledesc", 9},  {"timecode", 8},
    {"v2d", 16},           {"v2f", 8},       {"v2i", 8},
    {"v3d", 24},           {"v3f", 12},      {"v3i", 12},
});

/// Whether a list of channels ends where its attribute does.
bool is_whole_list(std::string_view list) {
    constexpr std::size_t kAfterName = 16;
    while (!list.empty() && list[0] != '\0') {
        const std::size_t end = list.find('\0');
        if (end == list.npos || list.size() - end - 1 < kAfterName) return false;
        list.remove_prefix(end + 1 + kAfterName);
    }
    return list.size() == 1;
}

/// Refuses an attribute whose value does not have the size that it claims, as far as OpenEXR does
/// not look at it.
void check_attribute(const std::filesystem::path& path, std::string_view type,
                     std::string_view value) {
    const auto* const fixed = std::ranges::find(kTypeSizes, type, &TypeSize::type);
    bool is_right = fixed == kTypeSizes.end() || value.size() == fixed->bytes;
    if (type == "chlist") is_right = is_whole_list(value);
    if (type == "preview") {
        constexpr std::size_t kHead = 8;
        const std::uint64_t width = number_at(path, value, 0);
        const std::uint64_t pixels = width * number_at(path, value, 4);
        is_right = value.size() % 4 == 0 && pixels == (value.size() - kHead) / 4;
    }
    for (std::size_t at = 0; type == "stringvector" && at < value.size();) {
        const std::uint32_t length = number_at(path, value, at);
        at += 4;
        if (length > value.size() - at) is_right = false;
        at += std::min<std::size_t>(length, value.size() - at);
    }
    if (!is_right)
        refuse(path, fmt::format("an attribute of type {} has another size", shown(type)));
}

/// Refuses kinds of files that are not read, and headers whose attributes claim more bytes than the
/// file has, for which OpenEXR would allocate them. After magic number and version a header is a
/// list of name, zero, type, zero, size and value, up to an empty name.
void check_head(const std::filesystem::path& path, std::string_view bytes) {
    constexpr std::uint32_t kMagic = 20000630;
    constexpr std::uint32_t kTiled = 0x200;
    constexpr std::uint32_t kDeep = 0x800;
    constexpr std::uint32_t kMultiPart = 0x1000;
    if (number_at(path, bytes, 0) != kMagic) refuse(path, "it does not begin like one");
    const std::uint32_t version = number_at(path, bytes, 4);
    if ((version & kMultiPart) != 0) refuse(path, "it has several parts");
    if ((version & kDeep) != 0) refuse(path, "it has deep pixels");
    if ((version & kTiled) != 0) refuse(path, "it is stored in tiles instead of scan lines");
    std::size_t at = 8;
    while (at < bytes.size() && bytes[at] != '\0') {
        const std::size_t type = bytes.find('\0', at);
        const std::size_t size = type == bytes.npos ? type : bytes.find('\0', type + 1);
        if (size == bytes.npos) refuse(path, "it ends too early");
        const std::uint32_t length = number_at(path, bytes, size + 1);
        if (length > bytes.size() - (size + 5)) refuse(path, "it ends too early");
        check_attribute(path, bytes.substr(type + 1, size - type - 1),
                        bytes.substr(size + 5, length));
        at = size + 5 + length;
    }
    if (at >= bytes.size()) refuse(path, "it ends too early");
}

/// Returns `call()`, whose exceptions of OpenEXR become Error(kBadInput).
template <class Call>
auto guarded(const std::filesystem::path& path, Call call) {
    try {
        return call();
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        // It may quote bytes of the file.
        refuse(path, shown(error.what()));
    }
}

std::optional<ExrType> type_of(Imf::PixelType type) {
    if (type == Imf::HALF) return ExrType::kHalf;
    if (type == Imf::FLOAT) return ExrType::kFloat;
    if (type == Imf::UINT) return ExrType::kUint;
    return std::nullopt;
}

std::vector<ExrChannel> channels_of(const std::filesystem::path& path, const Imf::Header& header) {
    std::vector<ExrChannel> channels;
    for (auto at = header.channels().begin(); at != header.channels().end(); ++at) {
        const Imf::Channel& channel = at.channel();
        const std::optional<ExrType> type = type_of(channel.type);
        if (!type) refuse(path, fmt::format("channel {} has an unknown type", shown(at.name())));
        if (channel.xSampling != 1 || channel.ySampling != 1)
            refuse(path, fmt::format("channel {} has no value for some pixels", shown(at.name())));
        if (channels.size() == kMostChannels)
            refuse(path, fmt::format("it has more than {} channels", kMostChannels));
        channels.push_back({at.name(), *type});
    }
    if (channels.empty()) refuse(path, "it has no channels");
    return channels;
}

float float_of_half(std::uint32_t bits) {
    half number;
    number.setBits(static_cast<std::uint16_t>(bits));
    return number;
}

}  // namespace

struct ExrReader::File {
    MemoryStream stream;
    // Its constructor reads headers and tables, whose sizes it compares with that of the file.
    Imf::MultiPartInputFile parts;
    std::optional<Imf::InputPart> image;
    std::vector<ExrChannel> channels;
    // Pixels of the image have any origin.
    std::int64_t left = 0;
    std::int64_t top = 0;
    std::uint32_t width = 0;
    std::uint32_t height = 0;

    File(const std::string& name, std::string bytes)
        : stream(name, std::move(bytes)), parts(stream, /*numThreads=*/0, /*reconstruct=*/false) {}

    void check(const std::filesystem::path& path);
};

void ExrReader::File::check(const std::filesystem::path& path) {
    const Imf::Header& header = parts.header(0);
    if (header.hasType() && header.type() != Imf::SCANLINEIMAGE)
        refuse(path, fmt::format("it is of type {}", shown(header.type())));
    const auto& window = header.dataWindow();
    left = window.min.x;
    top = window.min.y;
    const std::int64_t columns = std::int64_t{window.max.x} - left + 1;
    const std::int64_t rows = std::int64_t{window.max.y} - top + 1;
    if (columns < 1 || rows < 1) refuse(path, "it has no pixels");
    const auto sides = {static_cast<std::uint64_t>(columns), static_cast<std::uint64_t>(rows)};
    const std::uint64_t larger = std::max(sides);
    if (larger > kMostSide || std::min(sides) * larger > kMostPixels) {
        throw Error(ErrorKind::kLimit,
                    fmt::format("{}: has {}x{} pixels; at most {} a side and 2^28 can be read",
                                shown(path), columns, rows, kMostSide));
    }
    width = static_cast<std::uint32_t>(columns);
    height = static_cast<std::uint32_t>(rows);
    channels = channels_of(path, header);
    // A block, the one that it is unpacked from, and the rows that are read.
    const std::uint64_t bytes = 3 * kMostRowsOfBlock * width * channels.size() * 4;
    if (bytes > kAlwaysThere) require_memory({.kept_bytes = bytes});
    image.emplace(parts, 0);
}

bool is_exr_name(const std::filesystem::path& path) {
    return lower_case(path.extension().native()) == ".exr";
}

const char* name_of(ExrType type) {
    if (type == ExrType::kHalf) return "half";
    return type == ExrType::kFloat ? "float" : "uint";
}

double value_of(ExrType type, std::uint32_t bits) {
    if (type == ExrType::kHalf) return float_of_half(bits);
    if (type == ExrType::kFloat) return std::bit_cast<float>(bits);
    return bits;
}

ExrReader::ExrReader(const std::filesystem::path& path) : path_(path) {
    std::string bytes = read_input_file(path);
    check_head(path, bytes);
    file_ = guarded(path, [&] {
        auto file = std::make_unique<File>(path.filename().native(), std::move(bytes));
        file->check(path);
        return file;
    });
}

ExrReader::~ExrReader() = default;

std::uint32_t ExrReader::width() const { return file_->width; }
std::uint32_t ExrReader::height() const { return file_->height; }
const std::vector<ExrChannel>& ExrReader::channels() const { return file_->channels; }

std::string ExrReader::attribute(const std::string& name) const {
    const auto* const text = file_->parts.header(0).findTypedAttribute<Imf::StringAttribute>(name);
    return text == nullptr ? std::string() : text->value();
}

std::vector<std::vector<std::uint32_t>> ExrReader::read_rows(std::uint32_t row,
                                                             std::uint32_t count) {
    assert(count > 0 && row + count <= height());
    const std::size_t values = std::size_t{count} * width();
    const std::size_t channel_count = channels().size();
    std::vector<std::vector<std::uint32_t>> planes(channel_count);
    std::vector<std::vector<std::uint16_t>> halves(channel_count);
    Imf::FrameBuffer buffer;
    const Imath::V2i origin(static_cast<int>(file_->left), static_cast<int>(file_->top + row));
    const auto insert = [&](const char* name, Imf::PixelType type, auto& plane) {
        plane.resize(values);
        buffer.insert(name, Imf::Slice::Make(type, plane.data(), origin, width(), count));
    };
    for (std::size_t k = 0; k < channel_count; ++k) {
        const ExrChannel& channel = channels()[k];
        if (channel.type == ExrType::kHalf)
            insert(channel.name.c_str(), Imf::HALF, halves[k]);
        else
            insert(channel.name.c_str(), channel.type == ExrType::kFloat ? Imf::FLOAT : Imf::UINT,
                   planes[k]);
    }
    guarded(path_, [&] {
        file_->image->setFrameBuffer(buffer);
        file_->image->readPixels(origin.y, origin.y + static_cast<int>(count) - 1);
    });
    for (std::size_t k = 0; k < channel_count; ++k)
        if (!halves[k].empty()) planes[k].assign(halves[k].begin(), halves[k].end());
    return planes;
}

}  // namespace mray::app
