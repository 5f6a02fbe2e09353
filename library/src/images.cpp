#include "morphray/images.hpp"

#include <fmt/format.h>

#include <bit>
#include <cstring>

#include "common/base/input_file.h"
#include "common/base/output_file.h"
#include "common/image/png.h"
#include "common/interop/ray.h"
#include "common/text/text.h"
#include "library/src/scene/errors.h"
#include "morphray/scene.hpp"

namespace morphray {
namespace {

using namespace detail;

struct HitsHeader {
    char magic[8] = {'M', 'R', 'H', 'I', 'T', 'S', '1', '\0'};
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::uint32_t image_count = 0;
};
static_assert(sizeof(HitsHeader) == 20 && sizeof(mray::Hit) == 16, "no padding");
static_assert(std::endian::native == std::endian::little, "the file is written as memory is");

HitsFile parse(const std::string& file, std::string_view text) {
    const auto refuse = [&](const std::string& reason) {
        throw Error(ErrorCode::bad_input, mray::escape(file) + ": " + reason);
    };
    HitsHeader header;
    if (text.size() < sizeof(header)) refuse("not a file of hits: too short for its header");
    std::memcpy(&header, text.data(), sizeof(header));
    if (std::memcmp(header.magic, HitsHeader().magic, sizeof(header.magic)) != 0)
        refuse("not a file of hits, as `render --hits` writes: it does not begin with MRHITS1");
    const std::uint64_t pixels = std::uint64_t{header.width} * header.height;
    const std::uint64_t rest = text.size() - sizeof(header);
    const std::uint64_t per_image = sizeof(mray::Hit) + sizeof(std::uint32_t);
    // The numbers of a damaged file may overflow 64 bits.
    __extension__ typedef unsigned __int128 Wide;
    if (rest != Wide{pixels} * per_image * header.image_count) {
        refuse(fmt::format("{} bytes do not fit {} images of {}x{}", text.size(),
                           header.image_count, header.width, header.height));
    }
    HitsFile result = {header.width, header.height};
    const char* next = text.data() + sizeof(header);
    const auto take = [&](auto& values) {
        std::memcpy(values.data(), next, values.size() * sizeof(values[0]));
        next += values.size() * sizeof(values[0]);
    };
    std::vector<mray::Hit> hits(rest == 0 ? 0 : pixels);
    for (std::uint32_t i = 0; rest > 0 && i < header.image_count; ++i) {
        HitsFile::ImageHits& image = result.images.emplace_back();
        take(hits);
        for (const mray::Hit& hit : hits) {
            const bool missed = hit.prim_id == kNoPrim;
            image.hits.push_back(missed ? Hit{} : Hit{hit.t, hit.u, hit.v, hit.prim_id, 0});
        }
        image.occlusion.resize(pixels);
        take(image.occlusion);
    }
    return result;
}

/// Compares as many hits of both; same(i) tells whether what belongs to hit i is equal, too.
template <class Same>
Comparison compare_all(std::span<const Hit> first, std::span<const Hit> second, std::size_t keep,
                       Same same) {
    Comparison comparison;
    comparison.compared = first.size();
    for (std::size_t i = 0; i < first.size(); ++i) {
        if (std::memcmp(&first[i], &second[i], sizeof(Hit)) == 0 && same(i)) continue;
        ++comparison.different;
        if (comparison.differences.size() < keep)
            comparison.differences.push_back({i, first[i], second[i]});
    }
    return comparison;
}

std::string text_of(const Hit& hit) {
    if (!hit) return "a miss";
    return fmt::format("t {:.9g}, u {:.9g}, v {:.9g}, prim_id {}, geom_id {}", hit.t, hit.u, hit.v,
                       hit.prim_id, hit.geom_id);
}

}  // namespace

HitsWriter::HitsWriter(std::uint32_t width, std::uint32_t height)
    : width_(width), height_(height), bytes_(sizeof(HitsHeader)) {
    const HitsHeader header{.width = width, .height = height};
    std::memcpy(bytes_.data(), &header, sizeof(header));
}

void HitsWriter::add(const Image& image) {
    with_public_errors([&] {
        const std::size_t count = std::size_t{width_} * height_;
        const std::uint64_t side = sample_side(image.samples);
        if (image.width * side != width_ || image.height * side != height_ ||
            image.hits.size() != count || image.occlusion.size() != count)
            throw_bad_argument("HitsWriter: an image of another size");
        for (const Hit& hit : image.hits) {
            if (!hit || hit.geom_id == 0) continue;
            throw_bad_argument("HitsWriter: a hit of geom_id {}; the file has room for one mesh",
                               hit.geom_id);
        }
        // Nothing has changed if memory does not suffice.
        std::size_t at = bytes_.size();
        bytes_.resize(at + count * (sizeof(mray::Hit) + sizeof(std::uint32_t)));
        for (const Hit& hit : image.hits) {
            const mray::Hit written{hit.t, hit.u, hit.v, hit.prim_id};
            std::memcpy(bytes_.data() + at, &written, sizeof(written));
            at += sizeof(written);
        }
        // An empty image has null pointers, which memcpy does not take.
        if (count > 0)
            std::memcpy(bytes_.data() + at, image.occlusion.data(), count * sizeof(std::uint32_t));
        ++image_count_;
        std::memcpy(bytes_.data() + offsetof(HitsHeader, image_count), &image_count_,
                    sizeof(image_count_));
    });
}

void HitsWriter::write(const std::string& file) const {
    with_public_errors([&] { mray::write_file(file, bytes_); });
}
HitsFile read_hits(const std::string& file) {
    return with_public_errors([&] { return parse(file, mray::read_input_file(file)); });
}

void write_png(const std::string& file, const Image& image) {
    with_public_errors([&] {
        if (image.pixels.size() != std::size_t{image.width} * image.height || image.pixels.empty())
            throw_bad_argument("write_png: the image's pixels do not fit its size");
        mray::write_file(file, mray::encode_png({image.width, image.height, image.pixels}));
    });
}

Comparison compare(const Scene& first, const Scene& second, std::span<const Ray> rays,
                   std::size_t keep, const QueryOptions& options) {
    return with_public_errors([&] {
        std::vector<Hit> a(rays.size());
        std::vector<Hit> b(rays.size());
        first.intersect(rays, std::span<Hit>(a), options);
        second.intersect(rays, std::span<Hit>(b), options);
        return compare_all(a, b, keep, [](std::size_t) { return true; });
    });
}

Comparison compare(const Image& first, const Image& second, std::size_t keep) {
    return with_public_errors([&] {
        const std::size_t count = first.hits.size();
        const std::size_t side = sample_side(first.samples);
        const std::size_t row = first.width * side;
        const std::size_t pixels = std::size_t{first.width} * first.height;
        const bool fit = first.width == second.width && first.height == second.height &&
                         first.samples == second.samples && first.samples == side * side &&
                         pixels == first.pixels.size() && pixels == second.pixels.size() &&
                         count == pixels * first.samples && count == second.hits.size() &&
                         count == first.occlusion.size() && count == second.occlusion.size();
        if (!fit) throw_bad_argument("compare: the images have different sizes, or no hits");
        // A pixel counts with its first sample.
        const auto same_pixel = [&](std::size_t x, std::size_t y) {
            if (x % side != 0 || y % side != 0) return true;
            const std::size_t pixel = y / side * first.width + x / side;
            return first.pixels[pixel] == second.pixels[pixel];
        };
        return compare_all(first.hits, second.hits, keep, [&](std::size_t i) {
            return first.occlusion[i] == second.occlusion[i] && same_pixel(i % row, i / row);
        });
    });
}

std::string describe(const Comparison& comparison) {
    return with_public_errors([&] {
        if (comparison.equal()) return fmt::format("{} equal", comparison.compared);
        std::string text =
            fmt::format("{} of {} differ", comparison.different, comparison.compared);
        for (const HitDifference& d : comparison.differences)
            text += fmt::format("\n{}: {}; {}", d.index, text_of(d.first), text_of(d.second));
        return text;
    });
}

}  // namespace morphray
