# cmake -D ROOT=checkout -P check_layering.cmake: fails with a line for each #include that a room may
# not have by the tables below (docs/architecture.md draws them), that brings a library outside its one
# place, and for names in documents and comments of what is not there. Public headers are included as
# <morphray/...> or "morphray/...".
cmake_minimum_required(VERSION 3.25)

# A file is in the first of these rooms that its path begins with. may_see_X: the rooms whose headers
# room X may include, besides its own.
set(rooms common/interop report common cpu gpu shaders library/include library/src library/embree
    library/python library/examples scenes lab/methods lab/accuracy lab/bench lab/proofs app tests)
set(may_see_common/interop)
set(may_see_common common/interop)
set(may_see_report common common/interop)
set(may_see_cpu common common/interop)
set(may_see_gpu shaders common common/interop)
set(may_see_shaders common/interop)
set(may_see_library/include)
set(may_see_library/src library/include cpu gpu common common/interop)
set(may_see_library/embree library/include)
set(may_see_library/python library/include)
set(may_see_library/examples library/include)
set(may_see_scenes common common/interop)
set(may_see_lab/methods report cpu gpu shaders common common/interop)
set(may_see_lab/accuracy lab/methods report scenes cpu gpu common common/interop)
set(may_see_lab/bench lab/methods library/include report scenes cpu gpu shaders common common/interop)
set(may_see_lab/proofs cpu common common/interop)
set(may_see_app library/include library/src report scenes common common/interop)
set(may_see_tests library/include library/src report scenes cpu gpu common common/interop)
# Further rooms of a folder of tests.
set(tests_of_app app)
set(tests_of_fuzz app)
set(tests_of_gpu shaders)
set(tests_of_lab lab/accuracy lab/bench lab/methods)
set(tests_of_library library/python)
set(tests_of_shaders shaders)

# The folders of the program, and of what it includes of itself. Files of app/ itself may include all.
set(app_rooms base cli animation report view commands)
set(app_base_sees)
set(app_cli_sees base)
set(app_animation_sees base)
set(app_report_sees base)
set(app_view_sees base animation)
set(app_commands_sees ${app_rooms})
# Trees and tracers are for these folders of the program, which reach them by one header of the library.
# Other ones may include these headers, which hold plain data.
set(engine "^(library/src/|common/(backend|scene_queries)\\.h$|common/(bvh|update)/)")
set(engine_users "^app/(animation|commands)/")
set(engine_data "^common/(bvh/builder/bvh_builder|update/policy)\\.h$")

# The orders of the folders of other rooms: one may include those before it.
set(order_of_scenes polygons json mesh obj ply sequence gltf procedural)
set(order_of_common interop text base simd scene bvh image update)
set(order_of_cpu simd single_ray packet image queries reference refit scene_space)
set(order_of_shaders single_ray occlusion queries refit shade)

# Where a library may be included: the regular expression of the header, then that of the files.
set(places
    "^hwy/"                     "^((cpu|common/simd|common/bvh|scenes/gltf)/.*-inl\\.h|tests/cpu/.*)$"
    "^(vulkan/|volk/|volk\\.h)" "^(gpu|tests/(gpu|faults)|library/examples)/"
    "^(gtest|gmock)/"           "^tests/"
    "^(GLFW/|imgui|backends/)"  "^(tests/)?app/view/"
    "^png\\.h$"                 "^(tests/|app/base/image_files\\.cpp$)"
    "^(turbojpeg|j(peglib|error))\\.h$" "^(tests/|app/base/image_files\\.cpp$)"
    "^(OpenEXR/|Iex\\.h$)"      "^(tests/|app/base/image_files\\.cpp$)"
    "^benchmark/"               "^lab/bench/"
    "^embree[0-9]+/"            "^(lab/methods/embree\\.h$|library/embree/|tests/library/embree/)"
    "^pybind11/"                "^library/python/module/"
    "^gmp(xx)?\\.h$"            "^(common/scene/exact_crossing\\.cpp$|(tests/)?common/bvh/exact_closest|lab/accuracy/|scenes/polygons/triangulate\\.cpp$)"
    "^xxhash\\.h$"              "^common/base/hash\\.h$"
    # One source that reads JSON, and one header for writing it.
    "^nlohmann/"                "^(scenes/json/json_at\\.h$|app/report/json_parts\\.h$|tests/)"
    # The command lines of the program, of the benchmark and of the fuzzer.
    "^CLI/"                     "^(app/cli/|lab/bench/options\\.cpp$|tests/fuzz/([a-z_]+/)?[a-z_]+_fuzz\\.cpp$)"
    "stb_image\\.h$"            "^$")
# Included by one .cpp each.
set(one_source_each tiny_obj_loader stb_image_write)

set(violations "")
macro(violation file include reason)
    list(APPEND violations "${file} includes ${include}: ${reason}")
endmacro()

# room_of(path out): the first of `rooms` that the path lies in, or "".
function(room_of path out)
    set(${out} "" PARENT_SCOPE)
    foreach(room IN LISTS rooms)
        if(path MATCHES "^${room}/")
            set(${out} ${room} PARENT_SCOPE)
            return()
        endif()
    endforeach()
endfunction()

# folder_of(path out): the room and the folder directly below it, such as "cpu/packet"; "" for a file
# of the room itself. The folders of common/interop and of tests are not looked at.
function(folder_of path out)
    set(${out} "" PARENT_SCOPE)
    if(path MATCHES "^(app|common|cpu|gpu|shaders|scenes|library/src|library/python|lab/accuracy|lab/bench)/([^/]+)/")
        set(${out} ${CMAKE_MATCH_1}/${CMAKE_MATCH_2} PARENT_SCOPE)
    endif()
endfunction()

set(files "")
foreach(room IN LISTS rooms)
    foreach(extension h hpp inl cpp cc c comp glsl vert frag in)
        file(GLOB_RECURSE found RELATIVE ${ROOT} ${ROOT}/${room}/*.${extension})
        list(APPEND files ${found})
    endforeach()
endforeach()
list(REMOVE_DUPLICATES files)
list(LENGTH files count)
if(count EQUAL 0)
    message(FATAL_ERROR "no sources under '${ROOT}'")
endif()

foreach(file IN LISTS files)
    room_of(${file} from)
    folder_of(${file} from_folder)
    set(visible ${from} ${may_see_${from}})
    if(file MATCHES "^tests/([a-z]+)/")
        list(APPEND visible ${tests_of_${CMAKE_MATCH_1}})
    endif()
    file(STRINGS ${ROOT}/${file} lines REGEX "^[ \t]*#[ \t]*include[ \t]*[<\"]")
    # The file that Highway compiles once for each target.
    set(dispatches FALSE)
    if(file MATCHES "^(cpu|common/simd|common/bvh|lab/methods|scenes/gltf)/.*\\.cpp$" AND lines MATCHES "hwy/foreach_target\\.h")
        set(dispatches TRUE)
    endif()
    foreach(line IN LISTS lines)
        string(REGEX MATCH "([<\"])([^>\"]*)[>\"]" unused "${line}")
        set(quote "${CMAKE_MATCH_1}")
        set(include "${CMAKE_MATCH_2}")

        set(is_library FALSE)
        set(rest ${places})
        while(rest)
            list(POP_FRONT rest header place)
            if(include MATCHES "${header}")
                set(is_library TRUE)
                if(NOT file MATCHES "${place}" AND NOT (dispatches AND include MATCHES "^hwy/"))
                    violation(${file} ${include} "this library has another place")
                endif()
            endif()
        endwhile()
        foreach(library IN LISTS one_source_each)
            if(include MATCHES "${library}")
                set(is_library TRUE)
                if(NOT file MATCHES "\\.cpp$" OR file MATCHES "^tests/")
                    violation(${file} ${include} "only one .cpp may include this library")
                else()
                    list(APPEND users_of_${library} ${file})
                endif()
            endif()
        endforeach()

        string(REGEX REPLACE "^morphray/" "library/include/morphray/" path ${include})
        room_of(${path} to)
        if(to)
            if(NOT to IN_LIST visible)
                violation(${file} ${include} "${from} must not see ${to}")
            endif()
        elseif(quote STREQUAL "\"" AND NOT is_library)
            violation(${file} ${include} "not a path from the root of the repository")
        endif()
        if(from MATCHES "^app" AND path MATCHES "${engine}" AND NOT file MATCHES "${engine_users}"
                AND NOT path MATCHES "${engine_data}")
            violation(${file} ${include} "only commands and the animation may see the engine")
        endif()
        if(from STREQUAL app AND to STREQUAL library/src AND NOT path STREQUAL library/src/engine.h)
            violation(${file} ${include} "the program sees library/src/engine.h alone")
        endif()

        folder_of(${path} to_folder)
        if(from_folder STREQUAL to_folder OR from_folder STREQUAL "" OR to_folder STREQUAL "")
            continue()
        endif()
        get_filename_component(parent ${from_folder} DIRECTORY)
        get_filename_component(to_parent ${to_folder} DIRECTORY)
        if(NOT parent STREQUAL to_parent)
            continue()
        endif()
        get_filename_component(from_name ${from_folder} NAME)
        get_filename_component(to_name ${to_folder} NAME)
        if(parent STREQUAL app)
            if(NOT to_name IN_LIST app_${from_name}_sees)
                violation(${file} ${include} "app/${from_name} must not see app/${to_name}")
            endif()
            continue()
        endif()
        list(FIND order_of_${parent} ${from_name} from_place)
        list(FIND order_of_${parent} ${to_name} to_place)
        if(to_place GREATER from_place OR to_place EQUAL -1)
            violation(${file} ${include} "${from_folder} comes before ${to_folder}")
        endif()
    endforeach()
endforeach()

foreach(library IN LISTS one_source_each)
    list(REMOVE_DUPLICATES users_of_${library})
    list(LENGTH users_of_${library} count)
    if(count GREATER 1)
        list(JOIN users_of_${library} ", " users)
        list(APPEND violations "${users} include ${library}: only one .cpp may")
    endif()
endforeach()

# Files, folders and names in backticks, and files in parentheses, in documents and comments must exist. A path
# begins at the root or in the folder of its document, or it is the end of one. A file of another commit is
# named COMMIT:PATH, and runs write into out/. A name, which must occur outside comments, is f(), kConstant or
# TwoWords. CHANGELOG.md names what has been removed.
set(folders .ci app cmake common cpu docs gpu lab library report scenes shaders tests)
list(TRANSFORM folders PREPEND ${ROOT}/ OUTPUT_VARIABLE globs)
list(TRANSFORM globs APPEND /*)
file(GLOB_RECURSE paths RELATIVE ${ROOT} ${globs})
file(GLOB found RELATIVE ${ROOT} ${ROOT}/*.* ${ROOT}/run ${ROOT}/test)
list(APPEND paths ${found})
list(JOIN paths "\n/" all_paths)
set(documents ${paths})
list(FILTER documents INCLUDE REGEX "\\.(c|cmake|comp|cpp|g|glsl|h|hpp|in|json|md|py|sh|txt)$")
list(REMOVE_ITEM documents CHANGELOG.md)
list(JOIN folders "|" roots)
set(token_pattern "`[A-Za-z0-9_./:-]+(\\(\\))?`|\\([a-z0-9_./-]+/[A-Za-z0-9_.-]+[.][a-z]+[#)]")
set(path_pattern "^(${roots})/[A-Za-z0-9_./-]+$|^[a-z._][a-z0-9_./-]*(/|\\.(comp|cpp|glsl|h|hpp|md|py|sh))$")
set(function_pattern "^(.*::)?([A-Za-z0-9_]+)\\(\\)$")
set(constant_or_type_pattern "^(.*::)?(k[A-Z][A-Za-z0-9]*|[A-Z][a-z0-9]+[A-Z][A-Za-z0-9]*)$")
set(code "")
set(part "")
set(names "")
foreach(document IN LISTS documents)
    file(READ ${ROOT}/${document} text)
    string(REGEX MATCHALL "${token_pattern}" tokens "${text}")
    list(REMOVE_DUPLICATES tokens)
    get_filename_component(folder ${ROOT}/${document} DIRECTORY)
    foreach(token IN LISTS tokens)
        string(REGEX MATCH "[A-Za-z0-9_./:-]+(\\(\\))?" token "${token}")
        if(token MATCHES "^out/")
            continue()
        elseif(token MATCHES "${path_pattern}")
            string(FIND "\n/${all_paths}" "/${token}" place)
            if(place EQUAL -1 AND NOT EXISTS ${folder}/${token})
                list(APPEND violations "${document} names ${token}, which is not there")
            endif()
        elseif(token MATCHES "${function_pattern}" OR token MATCHES "${constant_or_type_pattern}")
            list(APPEND names ${CMAKE_MATCH_2})
            list(APPEND users_of_${CMAKE_MATCH_2} ${document})
        endif()
    endforeach()
    if(NOT document MATCHES "[.]md$")
        string(REGEX REPLACE "//[^\n]*|`[^`\n]*`" "" text "${text}")
        string(APPEND part "${text}")
    endif()
    # Each APPEND copies all of its variable.
    string(LENGTH "${part}" length)
    if(length GREATER 200000)
        string(APPEND code "${part}")
        set(part "")
    endif()
endforeach()
string(APPEND code "${part}")
list(REMOVE_DUPLICATES names)
foreach(name IN LISTS names)
    string(FIND "${code}" ${name} place)
    if(place EQUAL -1)
        list(APPEND violations "${users_of_${name}}: ${name} is not there")
    endif()
endforeach()

if(violations)
    list(JOIN violations "\n" text)
    message(FATAL_ERROR "layering:\n${text}")
endif()
