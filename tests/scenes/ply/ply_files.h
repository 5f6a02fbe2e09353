// PLY files for tests, in all encodings.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <string>
#include <vector>

namespace mray::test {

enum class PlyEncoding { kText, kLittleEndian, kBigEndian };

struct PlyItems {
    std::string name;
    /// As in the header: "float x", "list uchar int vertex_indices".
    std::vector<std::string> properties;
    /// The values of each item; a list begins with the number of its entries.
    std::vector<std::vector<double>> items;
};

inline constexpr PlyEncoding kPlyEncodings[] = {PlyEncoding::kText, PlyEncoding::kLittleEndian,
                                                PlyEncoding::kBigEndian};

template <class T>
void append_ply_value(std::string& bytes, double value, bool is_big_endian) {
    const T number = static_cast<T>(value);
    char raw[sizeof(T)];
    std::memcpy(raw, &number, sizeof number);
    if (is_big_endian) std::reverse(raw, raw + sizeof raw);
    bytes.append(raw, sizeof raw);
}

inline void append_ply_value(std::string& bytes, const std::string& type, double value,
                             PlyEncoding encoding) {
    using Append = void (*)(std::string&, double, bool);
    static const std::map<std::string, Append> appends = {
        {"char", append_ply_value<std::int8_t>},     {"int8", append_ply_value<std::int8_t>},
        {"uchar", append_ply_value<std::uint8_t>},   {"uint8", append_ply_value<std::uint8_t>},
        {"short", append_ply_value<std::int16_t>},   {"int16", append_ply_value<std::int16_t>},
        {"ushort", append_ply_value<std::uint16_t>}, {"uint16", append_ply_value<std::uint16_t>},
        {"int", append_ply_value<std::int32_t>},     {"int32", append_ply_value<std::int32_t>},
        {"uint", append_ply_value<std::uint32_t>},   {"uint32", append_ply_value<std::uint32_t>},
        {"float", append_ply_value<float>},          {"float32", append_ply_value<float>},
        {"double", append_ply_value<double>},        {"float64", append_ply_value<double>}};
    if (encoding == PlyEncoding::kText)
        bytes += fmt::format("{} ", value);
    else
        appends.at(type)(bytes, value, encoding == PlyEncoding::kBigEndian);
}

inline std::string ply_format(PlyEncoding encoding) {
    if (encoding == PlyEncoding::kText) return "ascii";
    return encoding == PlyEncoding::kBigEndian ? "binary_big_endian" : "binary_little_endian";
}

inline std::string ply_header(PlyEncoding encoding, const std::vector<PlyItems>& parts,
                              const std::string& line_end = "\n") {
    std::string text = "ply" + line_end + "format " + ply_format(encoding) + " 1.0" + line_end;
    for (const PlyItems& part : parts) {
        text += fmt::format("element {} {}{}", part.name, part.items.size(), line_end);
        for (const std::string& property : part.properties)
            text += "property " + property + line_end;
    }
    return text + "end_header" + line_end;
}

inline std::string ply_body(PlyEncoding encoding, const std::vector<PlyItems>& parts) {
    std::string bytes;
    for (const PlyItems& part : parts) {
        for (const std::vector<double>& item : part.items) {
            std::size_t next = 0;
            for (const std::string& property : part.properties) {
                std::vector<std::string> words;
                for (std::size_t at = 0; at <= property.size();) {
                    const std::size_t end = std::min(property.find(' ', at), property.size());
                    words.push_back(property.substr(at, end - at));
                    at = end + 1;
                }
                std::size_t count = 1;
                if (words[0] == "list") {
                    count = static_cast<std::size_t>(item[next]);
                    append_ply_value(bytes, words[1], item[next++], encoding);
                }
                for (std::size_t i = 0; i < count; ++i)
                    append_ply_value(bytes, words[words.size() - 2], item[next++], encoding);
            }
            if (encoding == PlyEncoding::kText) bytes.back() = '\n';
        }
    }
    return bytes;
}

inline std::string ply(PlyEncoding encoding, const std::vector<PlyItems>& parts,
                       const std::string& line_end = "\n") {
    return ply_header(encoding, parts, line_end) + ply_body(encoding, parts);
}

inline PlyItems ply_vertices(std::vector<std::vector<double>> items,
                             const std::string& type = "float") {
    return {"vertex", {type + " x", type + " y", type + " z"}, std::move(items)};
}
inline PlyItems ply_faces(std::vector<std::vector<double>> items,
                          const std::string& types = "uchar int") {
    return {"face", {"list " + types + " vertex_indices"}, std::move(items)};
}

}  // namespace mray::test
