#include "clips/obj/tiny_obj.h"

#include <istream>
#include <map>
#include <streambuf>

#define TINYOBJLOADER_IMPLEMENTATION
#include <tiny_obj_loader.h>

namespace mray {
namespace {

// Reads from memory without copying it. Never writes to the buffer.
class TextBuffer : public std::streambuf {
public:
    explicit TextBuffer(std::string_view text) {
        char* const begin = const_cast<char*>(text.data());
        setg(begin, begin, begin + text.size());
    }
};

struct Parse {
    ObjEvents& events;
    std::vector<int> indices;
};

Parse& parse_of(void* user_data) { return *static_cast<Parse*>(user_data); }

void on_vertex(void* user_data, float, float, float, float) { parse_of(user_data).events.vertex(); }

void on_face(void* user_data, tinyobj::index_t* corners, int count) {
    Parse& parse = parse_of(user_data);
    parse.indices.resize(static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < parse.indices.size(); ++i) {
        parse.indices[i] = corners[i].vertex_index;
    }
    parse.events.face(parse.indices);
}

void on_material(void* user_data, const char* name, int) {
    parse_of(user_data).events.use_material(name);
}

// tinyobjloader would open any path; here the events decide. The events keep the materials, because
// names need trimming before they are looked up. Each call reports a failure to tinyobjloader,
// which would otherwise stop at the first library of a line.
class LibraryEvents : public tinyobj::MaterialReader {
public:
    explicit LibraryEvents(ObjEvents& events) : events_(events) {}
    bool operator()(const std::string& name, std::vector<tinyobj::material_t>*,
                    std::map<std::string, int>*, std::string*, std::string*) override {
        events_.material_library(name);
        return false;
    }

private:
    ObjEvents& events_;
};

}  // namespace

void parse_obj_text(std::string_view text, ObjEvents& events) {
    TextBuffer buffer(text);
    std::istream stream(&buffer);
    LibraryEvents libraries(events);
    Parse parse{events, {}};
    tinyobj::callback_t callbacks;
    callbacks.vertex_cb = on_vertex;
    callbacks.index_cb = on_face;
    callbacks.usemtl_cb = on_material;
    tinyobj::LoadObjWithCallback(stream, callbacks, &parse, &libraries);
}

}  // namespace mray
