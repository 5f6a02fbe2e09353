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

/// Options of map_Kd that are not read, with the number of their values.
constexpr std::pair<std::string_view, int> kOtherOptions[] = {
    {"-blendu", 1},  {"-blendv", 1}, {"-texres", 1}, {"-boost", 1}, {"-bm", 1},
    {"-imfchan", 1}, {"-type", 1},   {"-cc", 1},     {"-mm", 2}};

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
              bool lenient, MaterialMap& materials)
        : lines_(text, name), library_(library), lenient_(lenient), materials_(materials) {}

    void read(const WarnFunction& warn) {
        while (!lines_.at_end()) read_statement(trimmed(lines_.next(), kBlanks));
        end_material();
        odd_.tell(warn);
    }

private:
    /// `instead` is what a lenient reader does.
    void refuse(const std::string& what, std::string_view instead) {
        if (!lenient_) lines_.fail(what + "; repair the material");
        odd_.add([&] { return Warning{lines_.place(), fmt::format("{}; {}", what, instead)}; });
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
            return refuse(fmt::format("Kd {} is not three finite numbers", quote(text)),
                          "taken as grey");
        }
        albedo_ = albedo_of(kd[0], kd[1], kd[2]);
    }

    /// Reads `[-option value ...] file`. A file name is all that follows the options, and may have
    /// blanks in it and quotes around it.
    void read_map(const std::string_view text) {
        TextureMap map;
        std::string_view rest = text;
        std::string problem;
        while (rest.starts_with('-') && problem.empty()) {
            const std::string_view before = rest;
            if (read_option(rest, map, problem)) continue;
            // A file name may begin with a dash.
            rest = before;
            break;
        }
        if (rest.size() > 1 && rest.front() == '"' && rest.back() == '"')
            rest = rest.substr(1, rest.size() - 2);
        if (rest.empty() && problem.empty()) problem = "names no file";
        if (!problem.empty())
            return refuse(fmt::format("map_Kd {} {}", quote(text), problem), "left out");
        map.file = rest;
        std::replace(map.file.begin(), map.file.end(), '\\', '/');
        map.place = lines_.place();
        map.library = library_;
        map_ = std::make_shared<const TextureMap>(std::move(map));
    }

    /// Takes an option with its values. Returns false if there is no such option.
    bool read_option(std::string_view& rest, TextureMap& map, std::string& problem) {
        const std::string_view option = take_word(rest);
        const std::string_view value = rest.substr(0, rest.find_first_of(kBlanks));
        bool is_good = true;
        if (option == "-clamp") {
            map.clamp = value == "on";
            is_good = map.clamp || value == "off";
            take_word(rest);
        } else if (option == "-s") {
            is_good = take_numbers(rest, map.scale);
        } else if (option == "-o") {
            is_good = take_numbers(rest, map.offset);
        } else if (option == "-t") {
            std::array<float, 2> turbulence = {};
            is_good = take_numbers(rest, turbulence);
        } else {
            const auto* const other =
                std::find_if(std::begin(kOtherOptions), std::end(kOtherOptions),
                             [&](const auto& known) { return known.first == option; });
            if (other == std::end(kOtherOptions)) return false;
            for (int i = 0; i < other->second; ++i) take_word(rest);
        }
        if (!is_good) problem = fmt::format("has {} {}", option, quote(value));
        return true;
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
    const bool lenient_;
    MaterialMap& materials_;
    std::string material_;
    std::optional<Albedo> albedo_;
    std::shared_ptr<const TextureMap> map_;
    WarningCount odd_;
};

}  // namespace

void read_mtl_text(std::string_view text, const std::filesystem::path& library,
                   const std::string& name, bool lenient, const WarnFunction& warn,
                   MaterialMap& materials) {
    MtlReader(text, library, name, lenient, materials).read(warn);
}

}  // namespace mray
