# morphray_precompile(TARGET GROUP HEADER...): compiles these headers, and those of the standard library that
# most files use, once for all targets of the group, which agree in optimisation and Highway's definitions: a
# third less time. A file still names what it uses, or a header that does: the presets dev and tidy, and
# builds with a launcher such as ccache, compile nothing in advance.
if(CMAKE_CXX_COMPILER_LAUNCHER)
    set(CMAKE_DISABLE_PRECOMPILE_HEADERS ON)
endif()
function(morphray_precompile target group)
    get_property(first GLOBAL PROPERTY morphray_precompiled_${group})
    if(first)
        target_precompile_headers(${target} REUSE_FROM ${first})
        return()
    endif()
    set_property(GLOBAL PROPERTY morphray_precompiled_${group} ${target})
    target_precompile_headers(${target} PRIVATE <algorithm> <array> <cmath> <cstdint> <cstring>
        <functional> <limits> <map> <memory> <optional> <span> <string> <string_view> <utility> <vector>
        <fmt/format.h> ${ARGN})
endfunction()

# morphray_compile_together(TARGET [FOLDERS]), called when the target has its sources: compiles at most 17 of
# them as one, or those of each folder, which takes half of the time. So names without linkage are unique there:
# another file's function that fits better would be called. Those that Highway compiles once an instruction set
# stay alone, as CMake leaves those with options of their own; so do all where nothing is compiled in advance.
function(morphray_compile_together target)
    if(NOT CMAKE_DISABLE_PRECOMPILE_HEADERS)
        set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
    endif()
    get_target_property(sources ${target} SOURCES)
    list(FILTER sources INCLUDE REGEX "[.]cpp$")
    foreach(source IN LISTS sources)
        get_filename_component(path ${source} ABSOLUTE)
        file(STRINGS ${path} per_instruction_set REGEX "define HWY_TARGET_INCLUDE" LIMIT_COUNT 1)
        if(NOT per_instruction_set)
            set(key ${target})
            if(ARGN)
                get_filename_component(folder ${source} DIRECTORY)
                string(MAKE_C_IDENTIFIER "${target}_${folder}" key)
            endif()
            list(APPEND all_${key} ${source})
            list(LENGTH all_${key} count)
            math(EXPR part "(${count} - 1) / 17")
            set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${key}_${part})
        endif()
    endforeach()
endfunction()
