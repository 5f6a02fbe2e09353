"""check_layering.py CHECKOUT: fails with a line for each #include that a room may not have by the tables below
(docs/architecture.md draws them), that brings a library outside its one place, and for names in documents and comments
of what is not there. Public headers are included as <morphray/...> or "morphray/..."."""

import pathlib
import re
import sys

# A file is in the first of these rooms that its path begins with; a room includes the headers of its own and of these.
ENGINE = "cpu gpu common common/interop"
MAY_SEE = {
    "common/interop": "",
    "report": "common common/interop",
    "common": "common/interop",
    "cpu": "common common/interop",
    "gpu": "shaders common common/interop",
    "shaders": "common/interop",
    "library/include": "",
    "library/src": f"library/include {ENGINE}",
    "library/embree": "library/include",
    "library/python": "library/include",
    "library/examples": "library/include",
    "scenes": "common common/interop",
    "lab/methods": f"report shaders {ENGINE}",
    "lab/accuracy": f"lab/methods report scenes {ENGINE}",
    "lab/bench": f"lab/gpu_model lab/methods library/include report scenes shaders {ENGINE}",
    "lab/gpu_model": "lab/methods cpu common common/interop",
    "lab/proofs": "cpu common common/interop",
    "app": "library/include library/src report scenes common common/interop",
    "tests": f"library/include library/src report scenes {ENGINE}",
}
# Further rooms of a folder of tests.
TESTS_SEE = {"app": "app", "fuzz": "app", "gpu": "shaders", "library": "library/python", "shaders": "shaders",
             "lab": "lab/accuracy lab/bench lab/gpu_model lab/methods"}

# The folders of the program, and of what it includes of itself. Files of app/ itself may include all.
APP_SEES = {"base": "", "cli": "base", "animation": "base", "report": "base", "view": "base animation",
            "commands": "base cli animation report view"}
# Trees and tracers are for these folders of the program, which reach them by one header of the library. Other ones
# may include these headers, which hold plain data.
TREES_AND_TRACERS = r"library/src/|common/(backend|scene_queries)\.h$|common/(bvh|update)/"
THEIR_USERS = "app/(animation|commands)/"
THEIR_DATA = r"common/(bvh/builder/bvh_builder|update/policy)\.h$"

# The orders of the folders of other rooms: one may include those before it.
ORDERS = {"scenes": "polygons json mesh obj ply sequence gltf procedural",
          "common": "interop text base simd scene bvh image update",
          "cpu": "simd single_ray packet image queries reference refit scene_space",
          "shaders": "single_ray occlusion queries refit shade"}

# Where a library may be included: the regular expression of the header, then that of the files.
IMAGE_FILES = r"tests/|app/base/image_files\.cpp$"
PLACES = {
    "hwy/": r"((cpu|common/simd|common/bvh|scenes/gltf)/.*-inl\.h|tests/cpu/.*)$",
    r"vulkan/|volk/|volk\.h": "(gpu|tests/(gpu|faults)|library/examples)/",
    "(gtest|gmock)/": "tests/",
    "GLFW/|imgui|backends/": "(tests/)?app/view/",
    r"png\.h$": IMAGE_FILES,
    r"(turbojpeg|j(peglib|error))\.h$": IMAGE_FILES,
    r"OpenEXR/|Iex\.h$": IMAGE_FILES,
    "benchmark/": "lab/bench/",
    "embree[0-9]+/": r"lab/methods/embree\.h$|library/embree/|tests/library/embree/",
    "pybind11/": "library/python/module/",
    r"gmp(xx)?\.h$": r"common/base/whole_vector\.h$|tests/library/crossings_test|"
                     r"tests/common/bvh/exact_closest|lab/accuracy/|tests/common/interop/refined_hit_test|"
                     r"scenes/polygons/triangulate\.cpp$",
    r"(CGAL|fcl)/": r"lab/methods/crossing_peers\.cpp$",
    r"xxhash\.h$": r"common/base/hash\.h$",
    # One source that reads JSON, one header for writing it, and what scripts are given.
    "nlohmann/": r"scenes/json/json_at\.h$|app/report/json_parts\.h$|report/plot\.cpp$|tests/",
    # The command lines of the program, of the benchmark and of the fuzzer.
    "CLI/": r"app/cli/|lab/bench/main\.cpp$|tests/fuzz/([a-z_]+/)?[a-z_]+_fuzz\.cpp$",
    r"(.*/)?stb_image\.h$": "$",
}
# The files that Highway compiles once for each target.
DISPATCHING = r"(cpu|common/simd|common/bvh|lab/methods|scenes/gltf)/.*\.cpp$"
# Included by one .cpp each.
ONE_SOURCE_EACH = ("tiny_obj_loader", "stb_image_write")

SOURCES = {"h", "hpp", "inl", "cpp", "cc", "c", "comp", "glsl", "vert", "frag", "in"}
TOP_FOLDERS = ".ci app cmake common cpu docs gpu lab library report scenes shaders tests".split()

root = pathlib.Path(sys.argv[1])
violations = []


def room_of(path):
    return next((room for room in MAY_SEE if path.startswith(room + "/")), None)


def folder_of(path):
    """The room and the folder directly below it: those that have an order."""
    room, _, rest = path.partition("/")
    return (room, rest.partition("/")[0]) if "/" in rest and room in {"app", *ORDERS} else (None, None)


def is_of_library(file, include, dispatches):
    """Whether the header is one of a library; told where it has another place."""
    places = [place for header, place in PLACES.items() if re.match(header, include)]
    for place in places:
        if not re.match(place, file) and not (dispatches and include.startswith("hwy/")):
            violations.append(f"{file} includes {include}: this library has another place")
    return bool(places)


def check_order(file, include, path):
    (room, folder), (to_room, to_folder) = folder_of(file), folder_of(path)
    if room is None or room != to_room or folder == to_folder:
        return
    if room == "app":
        before = APP_SEES.get(folder, "").split()
    else:
        order = ORDERS[room].split()
        before = order[:order.index(folder)] if folder in order else []
    if to_folder not in before:
        violations.append(f"{file} includes {include}: {room}/{folder} must not see {room}/{to_folder}")


def check_includes(file, users):
    includes = re.findall(r'^[ \t]*#[ \t]*include[ \t]*([<"])([^>"\n]*)', (root / file).read_text(errors="replace"), re.M)
    dispatches = re.match(DISPATCHING, file) and any(name == "hwy/foreach_target.h" for _, name in includes)
    room = room_of(file)
    visible = [room, *MAY_SEE[room].split()]
    if room == "tests":
        visible += TESTS_SEE.get(file.split("/")[1], "").split()
    for quote, include in includes:
        def refuse(reason):
            violations.append(f"{file} includes {include}: {reason}")

        is_library = is_of_library(file, include, dispatches)
        for library in ONE_SOURCE_EACH:
            if library not in include:
                continue
            is_library = True
            users[library].add(file)
            if not file.endswith(".cpp") or room == "tests":
                refuse("only one .cpp may include this library")
        path = re.sub("^morphray/", "library/include/morphray/", include)
        to = room_of(path)
        if to and to not in visible:
            refuse(f"{room} must not see {to}")
        elif not to and quote == '"' and not is_library:
            refuse("not a path from the root of the repository")
        if (room == "app" and re.match(TREES_AND_TRACERS, path) and not re.match(THEIR_USERS, file)
                and not re.match(THEIR_DATA, path)):
            refuse("only commands and the animation may see the engine")
        if room == "app" and to == "library/src" and path != "library/src/engine.h":
            refuse("the program sees library/src/engine.h alone")
        check_order(file, include, path)


def check_names(paths):
    """Files, folders and names in backticks, and files in parentheses, in documents and comments must exist. A path
    begins at the root or in the folder of its document, or it is the end of one. A file of another commit is named
    COMMIT:PATH, and runs write into out/. A name, which must occur outside comments, is f(), kConstant, TwoWords or
    Type::member, which must occur within the type. CHANGELOG.md names what has been removed."""
    all_paths = "".join("\n/" + path for path in paths)
    token = re.compile(r"`([A-Za-z0-9_./:-]+(?:\(\))?)`|\(([a-z0-9_./-]+/[A-Za-z0-9_.-]+[.][a-z]+)[#)]")
    is_path = re.compile(rf"({'|'.join(TOP_FOLDERS)})/[A-Za-z0-9_./-]+$|"
                         r"[a-z._][a-z0-9_./-]*(/|\.(comp|cpp|glsl|h|hpp|md|py|sh))$")
    member = re.compile(r"(?:.*::)?([A-Z][A-Za-z0-9]*)::([a-z][A-Za-z0-9_]*)$")
    name_of = re.compile(r"(?:.*::)?(?:([A-Za-z0-9_]+)\(\)|(k[A-Z][A-Za-z0-9]*|[A-Z][a-z0-9]+[A-Z][A-Za-z0-9]*))$")
    names, members, code = {}, {}, []
    for document in paths:
        if document == "CHANGELOG.md" or not re.search(r"\.(c|cmake|comp|cpp|g|glsl|h|hpp|in|json|md|py|sh|txt)$", document):
            continue
        text = (root / document).read_text(errors="replace")
        for found in {a or b for a, b in token.findall(text)}:
            if found.startswith("out/"):
                continue
            if is_path.match(found):
                if "/" + found not in all_paths and not (root / document).parent.joinpath(found).exists():
                    violations.append(f"{document} names {found}, which is not there")
            elif match := member.match(found):
                members[match.groups()] = document
            elif match := name_of.match(found):
                names[match[1] or match[2]] = document
        if not document.endswith(".md"):
            code.append(re.sub(r"//[^\n]*|`[^`\n]*`", "", text))
    code = "".join(code)
    violations.extend(f"{document}: {name} is not there" for name, document in names.items() if name not in code)
    for (kind, name), document in members.items():
        # Any type of this name, from its head to the end of its block.
        blocks = re.findall(rf"(?:struct|class) (?:[A-Z_]+ )?{kind}(?: :[^{{;]*)? {{.*?\n}}", code, re.S)
        if not any(re.search(rf"\b{name}\b", block) for block in blocks):
            violations.append(f"{document}: {kind}::{name} is not there")


def check_rows(document):
    """Rows of a file and a name that it has."""
    for file, name in re.findall(r"^[|] `([^`]+)` [|] `([^`]+)` [|]", (root / document).read_text(), re.M):
        if not (root / file).exists() or name not in (root / file).read_text():
            violations.append(f"{document}: {file} has no {name}")


tree = [*root.glob("*.*"), root / "run", root / "test"]
for top in TOP_FOLDERS:
    tree += (root / top).rglob("*")
paths = sorted(str(path.relative_to(root)) for path in tree if path.is_file())
sources = [path for path in paths if path.rpartition(".")[2] in SOURCES and room_of(path)]
if not sources:
    sys.exit(f"no sources under {root}")
users = {library: set() for library in ONE_SOURCE_EACH}
for source in sources:
    check_includes(source, users)
for library, files in users.items():
    if len(files) > 1:
        violations.append(f"{', '.join(sorted(files))} include {library}: only one .cpp may")
check_names(paths)
if (root / "docs/design/what_a_change_touches.md").exists():
    check_rows("docs/design/what_a_change_touches.md")
if violations:
    sys.exit("layering:\n" + "\n".join(violations))
