#include "scenes/obj/obj_materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/errors.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"
#include "scenes/obj/obj_lines.h"

namespace mray {
namespace {

constexpr std::string_view kBlanks = " \t\f";
constexpr Albedo kWhite = 0x00FFFFFF;

std::string_view take_word(std::string_view& rest) {
    const std::string_view word = rest.substr(0, rest.find_first_of(kBlanks));
    rest = trimmed(rest.substr(word.size()), kBlanks);
    return word;
}

/// Takes one to three finite numbers for u, v and w. Returns whether there are any.
bool take_numbers(std::string_view& rest, std::array<float, 2>& numbers) {
    for (std::size_t i = 0; i < 3; ++i) {
        std::string_view after = rest;
        const std::optional<float> number = parse_float(take_word(after));
        // The last word is the file.
        if (i > 0 && (!number || after.empty())) return true;
        if (!number || !std::isfinite(*number)) return false;
        if (i < numbers.size()) numbers[i] = *number;
        rest = after;
    }
    return true;
}

class MtlReader {
public:
    MtlReader(std::string_view text, const std::filesystem::path& library, const std::string& name,
              MaterialMap& materials)
        : lines_(text, name), library_(library), materials_(materials) {}

    void read(const WarnFunction& warn) {
        while (!lines_.at_end()) read_statement(trimmed(lines_.next(), kBlanks));
        end_material();
        odd_.tell(warn);
    }

private:
    void warn(const std::string& what) {
        odd_.add([&] { return Warning{lines_.place(), what}; });
    }

    void read_statement(std::string_view statement) {
        const std::string_view keyword = take_word(statement);
        if (keyword == "newmtl") {
            end_material();
            material_ = statement;
        } else if (keyword == "Kd") {
            read_kd(statement);
        } else if (keyword == "map_Kd" || keyword == "map_kd") {
            read_map(statement);
        }
    }

    void read_kd(const std::string_view text) {
        std::vector<std::string_view> words;
        std::string_view rest = text;
        for (auto word = next_word(rest); !word.empty(); word = next_word(rest))
            words.push_back(word);
        // "If only r is specified, then g and b are assumed to be equal to r" (MTL format).
        if (words.size() == 1) words.assign(3, words[0]);
        std::vector<float> kd;
        for (const std::string_view word : words) {
            const std::optional<float> number = parse_float(word);
            if (number && std::isfinite(*number)) kd.push_back(*number);
        }
        if (words.size() != 3 || kd.size() != 3) {
            return warn(
                fmt::format("Kd {} is not three finite numbers; taken as grey", quote(text)));
        }
        albedo_ = albedo_of(kd[0], kd[1], kd[2]);
    }

    /// Reads `[-option value ...] file`. A file name is all that follows the options, and may have
    /// blanks in it and quotes around it.
    void read_map(const std::string_view text) {
        TextureMap map;
        std::string_view rest = text;
        while (rest.starts_with('-')) {
            const std::string_view option = rest;
            if (read_option(rest, map)) continue;
            return warn(fmt::format("map_Kd has an option or value that is not read: {}; left out",
                                    quote(option)));
        }
        if (rest.size() > 1 && rest.front() == '"' && rest.back() == '"')
            rest = rest.substr(1, rest.size() - 2);
        if (rest.empty())
            return warn(fmt::format("map_Kd {} names no file; left out", quote(text)));
        map.file = rest;
        std::replace(map.file.begin(), map.file.end(), '\\', '/');
        map.place = lines_.place();
        map.library = library_;
        map_ = std::make_shared<const TextureMap>(std::move(map));
    }

    /// Takes an option with its values. Returns false for one that is not known, or without them.
    static bool read_option(std::string_view& rest, TextureMap& map) {
        const std::string_view option = take_word(rest);
        if (option == "-s") return take_numbers(rest, map.scale);
        if (option == "-o") return take_numbers(rest, map.offset);
        if (option != "-clamp") return false;
        const std::string_view value = take_word(rest);
        map.clamp = value == "on";
        return map.clamp || value == "off";
    }

    void end_material() {
        if (!material_.empty()) {
            Material material{.map = std::move(map_)};
            if (albedo_) material.albedo = material.textured_albedo = *albedo_;
            // Some exporters write black for materials whose colour is the texture.
            if (material.textured_albedo == 0) material.textured_albedo = kWhite;
            materials_.emplace(material_, std::move(material));
        }
        material_ = {};
        albedo_.reset();
        map_.reset();
    }

    ObjLines lines_;
    const std::filesystem::path& library_;
    MaterialMap& materials_;
    std::string material_;
    std::optional<Albedo> albedo_;
    std::shared_ptr<const TextureMap> map_;
    WarningCount odd_;
};

}  // namespace

void read_mtl_text(std::string_view text, const std::filesystem::path& library,
                   const std::string& name, const WarnFunction& warn, MaterialMap& materials) {
    MtlReader(text, library, name, materials).read(warn);
}

}  // namespace mray
