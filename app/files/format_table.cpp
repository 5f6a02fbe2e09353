#include "app/files/format_table.h"

#include <span>

#include "common/report/table.h"
#include "scenes/mesh/mesh_file.h"

namespace mray::app {
namespace {

constexpr FileFormat kOthers[] = {
    {"scene", "glTF", ".gltf .glb", true, false,
     "meshes, nodes, skins, morph targets, animations, colours, textures"},
    {"materials", "MTL", ".mtl", true, false, "colours and textures of OBJ files"},
    {"positions", "PC2", ".pc2", true, false, "point cache: positions of vertices over time"},
    {"texture", "PNG", ".png", true, false, "map_Kd of materials"},
    {"texture", "JPEG", ".jpg .jpeg", true, false, "map_Kd of materials"},
    {"rays", "text", "", true, false, "trace --rays: a ray a line"},
    {"rays", "binary", "", true, false, "trace --rays --binary: 8 floats a ray"},
    {"hits", "text", "", false, true, "trace --out: a hit a line"},
    {"hits", "raw", "", true, true, "render --hits; diff reads them"},
    {"image", "PNG", ".png", true, true, "render, view, chart; diff reads them"},
    {"image", "OpenEXR", ".exr", false, true, "render --exr"},
    {"report", "JSON", ".json", true, true, "--json; profile --baseline"},
    {"report", "JUnit", ".xml", false, true, "crosscheck --junit"},
    {"report", "HTML", ".html", false, true, "crosscheck --html, chart"},
    {"report", "CSV", ".csv", false, true, "profile --csv, chart"},
    {"report", "SVG", ".svg", false, true, "profile --plot, chart"},
};

}  // namespace

std::vector<FileFormat> file_formats() {
    std::vector<FileFormat> formats;
    for (const MeshFormat& mesh : mesh_formats())
        formats.push_back({"mesh", mesh.name, mesh.extension, true, false, mesh.content});
    formats.insert(formats.end(), std::begin(kOthers), std::end(kOthers));
    return formats;
}

std::string text_of(const std::vector<FileFormat>& formats) {
    Table table({"use", "format", "extensions", "read", "written", "content"});
    const auto yes = [](bool is) { return is ? "yes" : "no"; };
    for (const FileFormat& format : formats) {
        table.add({std::string(format.use), std::string(format.name),
                   format.extensions.empty() ? "any" : std::string(format.extensions),
                   yes(format.is_read), yes(format.is_written), std::string(format.content)});
    }
    return table.text();
}

}  // namespace mray::app
