#include "common/scene/formats/obj/mtl_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <vector>

#include "common/base/errors.h"
#include "common/scene/formats/obj/tiny_obj.h"
#include "common/text/message_text.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"

namespace mray {
namespace {

// tinyobjloader's material_t takes 1.5 kB, so libraries of a million materials are parsed in
// pieces.
constexpr std::size_t kMaterialsAtOnce = 1024;

constexpr std::string_view kBlanks = " \t\f";

std::vector<std::string_view> words_of(std::string_view text) {
    std::vector<std::string_view> tokens;
    for (text = trimmed(text, kBlanks); !text.empty();) {
        const std::size_t length = std::min(text.find_first_of(" \t"), text.size());
        tokens.push_back(text.substr(0, length));
        text = trimmed(text.substr(length), kBlanks);
    }
    return tokens;
}

// Reduces a library to the statements that are used, checks each, and lets tinyobjloader parse
// them.
class MtlReader {
public:
    MtlReader(const std::string& name, bool lenient, MaterialMap& materials)
        : name_(name), lenient_(lenient), materials_(materials) {}

    void read(std::string_view text, const WarnFunction& warn) {
        if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
        while (!text.empty()) {
            ++line_;
            const std::size_t length = std::min(text.find_first_of("\r\n"), text.size());
            read_statement(trimmed(text.substr(0, length), kBlanks));
            const bool two = text.substr(length).starts_with("\r\n");
            text.remove_prefix(std::min(text.size(), length + (two ? 2 : 1)));
        }
        end_material();
        flush();
        odd_colours_.tell(warn);
    }

private:
    [[noreturn]] void fail(const std::string& what) const {
        throw Error(ErrorKind::kBadInput, fmt::format("{}:{}: {}", name_, line_, what));
    }

    void read_statement(std::string_view statement) {
        if (statement.find('\0') != std::string_view::npos) {
            fail("NUL byte; this is binary data or UTF-16, save it as UTF-8 text");
        }
        const std::size_t length = std::min(statement.find_first_of(" \t"), statement.size());
        const std::string_view keyword = statement.substr(0, length);
        const std::string_view rest = trimmed(statement.substr(length), kBlanks);
        if (keyword == "newmtl") {
            end_material();
            material_ = rest;
        } else if (keyword == "Kd") {
            read_kd(rest);
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
        for (const std::string_view token : tokens) {
            const std::optional<float> number = parse_float(token);
            good = good && number && std::isfinite(*number);
        }
        if (!good) {
            const std::string what =
                fmt::format("Kd {} is not three finite numbers", in_quotes(rest));
            if (!lenient_) fail(what + "; repair the material");
            warn_default(what);
            return;
        }
        kd_ = fmt::format("Kd {} {} {}\n", tokens[0], tokens[1], tokens[2]);
    }

    void warn_default(const std::string& what) {
        odd_colours_.add([&] {
            return Warning{fmt::format("{}:{}", name_, line_), what + "; taken as grey"};
        });
    }

    void end_material() {
        if (material_.empty()) {
            kd_.clear();
            return;
        }
        if (kd_.empty()) {
            materials_.emplace(material_, kDefaultAlbedo);
        } else {
            reduced_ += fmt::format("newmtl {}\n{}", material_, kd_);
            if (++pending_ == kMaterialsAtOnce) flush();
        }
        material_ = {};
        kd_.clear();
    }

    void flush() {
        for (const ParsedMaterial& parsed : parse_mtl_text(reduced_)) {
            const auto& kd = parsed.diffuse;
            if (!parsed.name.empty()) {
                materials_.emplace(parsed.name, albedo_of(kd[0], kd[1], kd[2]));
            }
        }
        reduced_.clear();
        pending_ = 0;
    }

    const std::string& name_;
    const bool lenient_;
    MaterialMap& materials_;
    std::uint64_t line_ = 0;
    std::string_view material_;
    std::string kd_;
    std::string reduced_;
    std::size_t pending_ = 0;
    WarningCount odd_colours_;
};

Albedo channel(float value) {
    return static_cast<Albedo>(std::lround(std::clamp(value, 0.0f, 1.0f) * 255.0f));
}

}  // namespace

void read_mtl_text(std::string_view text, const std::string& name, bool lenient,
                   const WarnFunction& warn, MaterialMap& materials) {
    MtlReader(name, lenient, materials).read(text, warn);
}

Albedo albedo_of(float r, float g, float b) {
    return channel(r) | channel(g) << 8 | channel(b) << 16;
}

}  // namespace mray
