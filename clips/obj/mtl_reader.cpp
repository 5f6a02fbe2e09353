#include "clips/obj/mtl_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "clips/obj/texture_map.h"
#include "common/base/errors.h"
#include "common/text/message_text.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"

namespace mray {
namespace {

std::vector<std::string_view> words_of(std::string_view text) {
    std::vector<std::string_view> tokens;
    for (text = trimmed(text, kMtlBlanks); !text.empty();) {
        const std::size_t length = std::min(text.find_first_of(" \t"), text.size());
        tokens.push_back(text.substr(0, length));
        text = trimmed(text.substr(length), kMtlBlanks);
    }
    return tokens;
}

class MtlReader {
public:
    MtlReader(const std::filesystem::path& library, const std::string& name, bool lenient,
              MaterialMap& materials)
        : library_(library), name_(name), lenient_(lenient), materials_(materials) {}

    void read(std::string_view text, const WarnFunction& warn) {
        if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
        while (!text.empty()) {
            ++line_;
            const std::size_t length = std::min(text.find_first_of("\r\n"), text.size());
            read_statement(trimmed(text.substr(0, length), kMtlBlanks));
            const bool two = text.substr(length).starts_with("\r\n");
            text.remove_prefix(std::min(text.size(), length + (two ? 2 : 1)));
        }
        end_material();
        odd_colours_.tell(warn);
        odd_maps_.tell(warn);
        black_maps_.tell(warn);
    }

private:
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kBadInput, fmt::format("{}: {}", place(), what));
    }
    std::string place() const { return fmt::format("{}:{}", name_, line_); }

    void read_statement(std::string_view statement) {
        if (statement.find('\0') != std::string_view::npos) {
            fail("NUL byte; this is binary data or UTF-16, save it as UTF-8 text");
        }
        const std::size_t length = std::min(statement.find_first_of(" \t"), statement.size());
        const std::string_view keyword = statement.substr(0, length);
        const std::string_view rest = trimmed(statement.substr(length), kMtlBlanks);
        if (keyword == "newmtl") {
            end_material();
            material_ = rest;
        } else if (keyword == "Kd") {
            read_kd(rest);
        } else if (keyword == "map_Kd" || keyword == "map_kd") {
            read_map(rest);
        }
    }

    void read_kd(std::string_view rest) {
        std::vector<std::string_view> tokens = words_of(rest);
        const auto comment = std::find_if(tokens.begin(), tokens.end(),
                                          [](std::string_view token) { return token[0] == '#'; });
        tokens.erase(comment, tokens.end());
        if (!tokens.empty() && (tokens[0] == "spectral" || tokens[0] == "xyz")) {
            warn_default(fmt::format("Kd as {} is not read", tokens[0]));
            return;
        }
        // "If only r is specified, then g and b are assumed to be equal to r" (MTL format).
        if (tokens.size() == 1) tokens.assign(3, tokens[0]);
        bool good = tokens.size() == 3;
        std::array<float, 3> kd = {};
        for (std::size_t i = 0; i < tokens.size() && good; ++i) {
            const std::optional<float> number = parse_float(tokens[i]);
            good = number && std::isfinite(*number);
            kd[i] = number.value_or(0);
        }
        if (!good) {
            const std::string what =
                fmt::format("Kd {} is not three finite numbers", in_quotes(rest));
            if (!lenient_) fail(what + "; repair the material");
            warn_default(what);
            return;
        }
        albedo_ = albedo_of(kd[0], kd[1], kd[2]);
    }

    void read_map(std::string_view rest) {
        ParsedMap parsed = parse_texture_map(rest);
        if (!parsed.problem.empty()) {
            const std::string what = fmt::format("map_Kd {} {}", in_quotes(rest), parsed.problem);
            if (!lenient_) fail(what + "; repair the material");
            warn_map(what + "; left out");
            return;
        }
        if (!parsed.ignored.empty())
            warn_map(fmt::format("option {} of map_Kd is not read; ignored", parsed.ignored));
        parsed.map.place = place();
        parsed.map.library = library_;
        map_ = std::make_shared<const TextureMap>(std::move(parsed.map));
    }

    void warn_default(const std::string& what) {
        odd_colours_.add([&] { return Warning{place(), what + "; taken as grey"}; });
    }
    void warn_map(const std::string& what) {
        odd_maps_.add([&] { return Warning{place(), what}; });
    }

    void end_material() {
        if (!material_.empty()) {
            Material material{.map = std::move(map_)};
            if (albedo_) material.albedo = material.textured_albedo = *albedo_;
            if (material.map != nullptr && material.textured_albedo == 0) {
                // Some exporters write it for materials whose colour is the texture.
                material.textured_albedo = kWhite;
                black_maps_.add([&] {
                    return Warning{material.map->place,
                                   fmt::format("Kd of material {} is black; taken as white, so "
                                               "that its texture shows",
                                               in_quotes(material_))};
                });
            }
            materials_.emplace(material_, std::move(material));
        }
        material_ = {};
        albedo_.reset();
        map_.reset();
    }

    static constexpr Albedo kWhite = 0x00FFFFFF;

    const std::filesystem::path& library_;
    const std::string& name_;
    const bool lenient_;
    MaterialMap& materials_;
    std::uint64_t line_ = 0;
    std::string_view material_;
    std::optional<Albedo> albedo_;
    std::shared_ptr<const TextureMap> map_;
    WarningCount odd_colours_;
    WarningCount odd_maps_;
    WarningCount black_maps_;
};

}  // namespace

void read_mtl_text(std::string_view text, const std::filesystem::path& library,
                   const std::string& name, bool lenient, const WarnFunction& warn,
                   MaterialMap& materials) {
    MtlReader(library, name, lenient, materials).read(text, warn);
}

}  // namespace mray
