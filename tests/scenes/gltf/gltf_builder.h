// Small glTF files for tests.
#pragma once

#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "tests/support/base64.h"

namespace mray::test {

using Json = nlohmann::json;

/// The number of a type of components.
template <class T>
constexpr int component_of() {
    if constexpr (std::is_same_v<T, std::int8_t>) return 5120;
    if constexpr (std::is_same_v<T, std::uint8_t>) return 5121;
    if constexpr (std::is_same_v<T, std::int16_t>) return 5122;
    if constexpr (std::is_same_v<T, std::uint16_t>) return 5123;
    if constexpr (std::is_same_v<T, std::uint32_t>) return 5125;
    return 5126;
}

/// A glTF file whose JSON and buffer a test writes and changes.
class GltfBuilder {
public:
    Json json = {{"asset", {{"version", "2.0"}}}};
    std::string bytes;

    template <class T>
    int add_view(const std::vector<T>& values, int stride = 0) {
        bytes.resize((bytes.size() + 3) / 4 * 4);
        Json view = {
            {"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", values.size() * sizeof(T)}};
        if (stride > 0) view["byteStride"] = stride;
        bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
        return add("bufferViews", view);
    }

    /// An accessor of all of these numbers.
    template <class T>
    int add_accessor(const std::vector<T>& values, const std::string& type,
                     bool normalized = false) {
        const std::size_t count = values.size() / width_of(type);
        Json accessor = {{"bufferView", add_view(values)},
                         {"componentType", component_of<T>()},
                         {"count", count},
                         {"type", type}};
        if (normalized) accessor["normalized"] = true;
        return add("accessors", accessor);
    }

    /// Appends to a list such as "nodes"; returns the index.
    int add(const char* list, const Json& value) {
        json[list].push_back(value);
        return static_cast<int>(json[list].size()) - 1;
    }

    int add_mesh(const Json& attributes, const Json& more = Json::object()) {
        Json primitive = {{"attributes", attributes}};
        primitive.update(more);
        return add("meshes", {{"primitives", Json::array({primitive})}});
    }

    /// The triangle (0, 0, 0), (1, 0, 0), (0, 1, 0) as a mesh; returns its index.
    int add_triangle() {
        return add_mesh({{"POSITION", add_accessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3")}});
    }

    /// An animation of one channel.
    int add_animation(int node, const std::string& path, const std::vector<float>& times,
                      int output, const std::string& interpolation = "LINEAR") {
        const Json sampler = {{"input", add_accessor(times, "SCALAR")},
                              {"output", output},
                              {"interpolation", interpolation}};
        const Json channel = {{"sampler", 0}, {"target", {{"node", node}, {"path", path}}}};
        return add("animations",
                   {{"samplers", Json::array({sampler})}, {"channels", Json::array({channel})}});
    }

    /// The file with its buffer as a data: URI.
    std::string gltf() const {
        Json whole = json;
        if (!bytes.empty() && !whole.contains("buffers")) {
            whole["buffers"] = {{{"byteLength", bytes.size()},
                                 {"uri", "data:application/octet-stream;base64," +
                                             base64(std::as_bytes(std::span(bytes)))}}};
        }
        return whole.dump();
    }

    std::string glb() const {
        Json whole = json;
        if (!bytes.empty() && !whole.contains("buffers"))
            whole["buffers"] = {{{"byteLength", bytes.size()}}};
        std::string text = whole.dump();
        text.resize((text.size() + 3) / 4 * 4, ' ');
        std::string binary = bytes;
        binary.resize((binary.size() + 3) / 4 * 4, '\0');
        std::string file = "glTF";
        append_word(file, 2);
        append_word(file, static_cast<std::uint32_t>(12 + 8 + text.size() +
                                                     (bytes.empty() ? 0 : 8 + binary.size())));
        append_word(file, static_cast<std::uint32_t>(text.size()));
        file += "JSON" + text;
        if (bytes.empty()) return file;
        append_word(file, static_cast<std::uint32_t>(binary.size()));
        return file + std::string("BIN\0", 4) + binary;
    }

    static void append_word(std::string& text, std::uint32_t word) {
        text.append(reinterpret_cast<const char*>(&word), sizeof word);
    }

private:
    static std::size_t width_of(const std::string& type) {
        if (type == "SCALAR") return 1;
        if (type == "MAT4") return 16;
        return static_cast<std::size_t>(type.back() - '0');
    }
};

/// The file with another value of a member, given as JSON; empty: without the member.
inline Json changed(Json file, const char* pointer, const char* value) {
    const Json::json_pointer place(pointer);
    if (*value != '\0')
        file[place] = Json::parse(value);
    else
        file.at(place.parent_pointer()).erase(place.back());
    return file;
}

/// A node with the triangle of GltfBuilder::add_triangle().
inline GltfBuilder triangle_file() {
    GltfBuilder builder;
    builder.add("nodes", {{"mesh", builder.add_triangle()}});
    return builder;
}

}  // namespace mray::test
