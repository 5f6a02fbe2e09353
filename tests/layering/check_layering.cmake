# cmake -D ROOT=checkout -P check_layering.cmake: fails with a line for each #include that points up
# or sideways in
#
#     app  accuracy  bench  tests  proofs -> library -> cpu, gpu -> common -> common/interop
#     app -> accuracy        gpu -> shaders -> common/interop        examples, python -> include
#
# or that brings a library outside its one place. What sees library sees include, too, whose files
# are included as <morphray/...> or "morphray/...". tests/app and tests/fuzz may also see app,
# tests/bench also bench, tests/accuracy also accuracy, tests/gpu and tests/shaders also shaders.
cmake_minimum_required(VERSION 3.25)

set(layers common/interop common cpu gpu shaders include library accuracy app bench tests proofs examples python)
set(may_see_common/interop common/interop)
set(may_see_common common common/interop)
set(may_see_cpu cpu common common/interop)
set(may_see_gpu gpu shaders common common/interop)
set(may_see_shaders shaders common/interop)
set(may_see_include include)
set(may_see_library library include cpu gpu common common/interop)
set(may_see_examples examples include)
set(may_see_python python include)
set(may_see_accuracy accuracy cpu gpu common common/interop)
set(may_see_app app library include accuracy cpu gpu common common/interop)
set(may_see_bench bench library include cpu gpu common common/interop)
set(may_see_tests tests library include cpu gpu common common/interop)
set(may_see_proofs proofs cpu common common/interop)

# Where a library may be included: the regular expression of the header, then that of the files.
set(places
    "^hwy/"                     "^((cpu|common/simd|common/bvh|common/scene/formats/gltf)/.*-inl\\.h|tests/cpu/.*)$"
    "^(vulkan/|volk/|volk\\.h)" "^(gpu|tests/(gpu|faults)|examples)/"
    "^(gtest|gmock)/"           "^tests/"
    "^(GLFW/|imgui|backends/)"  "^app/view/window/"
    "^png\\.h$"                 "^(tests/|app/files/png_reader\\.cpp$)"
    "^j(peglib|error)\\.h$"      "^(tests/|app/files/jpeg_reader\\.cpp$)"
    "^assimp/"                  "^app/files/formats/assimp_[a-z]+\\.cpp$"
    "^(OpenEXR/|Iex\\.h$)"      "^(tests/|app/files/exr_(reader|writer)\\.cpp$)"
    "^benchmark/"               "^bench/"
    "^embree"                   "^(bench|tests|accuracy/methods)/"
    "^tiny_bvh\\.h$"            "^bench/tinybvh/"
    "^pybind11/"                "^python/module/"
    "^gmp(xx)?\\.h$"            "^accuracy/"
    "^xxhash\\.h$"              "^common/base/hash\\.h$"
    # One room for JSON, which reports of the program and of the benchmark share.
    "^nlohmann/"                "^(common/text/json\\.h$|tests/)"
    # The command lines of the program and of the benchmark.
    "^CLI/"                     "^(app/cli/|bench/(two_builds/)?options\\.cpp$)"
    "stb_image\\.h$"            "^$")
# Included by one .cpp each.
set(one_source_each tiny_obj_loader stb_image_write)

set(violations "")
macro(violation file include reason)
    list(APPEND violations "${file} includes ${include}: ${reason}")
endmacro()

# layer_of(path out): the longest layer that the path lies in, or "".
function(layer_of path out)
    set(${out} "" PARENT_SCOPE)
    foreach(layer IN LISTS layers)
        if(path MATCHES "^${layer}/")
            set(${out} ${layer} PARENT_SCOPE)
            return()
        endif()
    endforeach()
endfunction()

set(files "")
foreach(layer IN LISTS layers)
    foreach(extension h hpp inl cpp cc c comp glsl vert frag in)
        file(GLOB_RECURSE found RELATIVE ${ROOT} ${ROOT}/${layer}/*.${extension})
        list(APPEND files ${found})
    endforeach()
endforeach()
list(REMOVE_DUPLICATES files)
list(LENGTH files count)
if(count EQUAL 0)
    message(FATAL_ERROR "no sources under '${ROOT}'")
endif()

foreach(file IN LISTS files)
    layer_of(${file} from)
    set(visible ${may_see_${from}})
    if(file MATCHES "^tests/(app|fuzz)/")
        list(APPEND visible app)
    elseif(file MATCHES "^tests/accuracy/")
        list(APPEND visible accuracy)
    elseif(file MATCHES "^tests/bench/")
        list(APPEND visible bench)
    elseif(file MATCHES "^tests/(gpu|shaders)/")
        list(APPEND visible shaders)
    endif()
    file(STRINGS ${ROOT}/${file} lines REGEX "^[ \t]*#[ \t]*include[ \t]*[<\"]")
    # The file that Highway compiles once for each target.
    set(dispatches FALSE)
    if(file MATCHES "^(cpu|common/simd|common/bvh|common/scene/formats/gltf)/.*\\.cpp$" AND lines MATCHES "hwy/foreach_target\\.h")
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

        string(REGEX REPLACE "^morphray/" "include/morphray/" path ${include})
        layer_of(${path} to)
        if(to)
            if(NOT to IN_LIST visible)
                violation(${file} ${include} "${from} must not see ${to}")
            endif()
        elseif(quote STREQUAL "\"" AND NOT is_library)
            violation(${file} ${include} "not a path from the root of the repository")
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

if(violations)
    list(JOIN violations "\n" text)
    message(FATAL_ERROR "layering:\n${text}")
endif()
