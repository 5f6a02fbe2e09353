# morphray_precompile(TARGET HEADER...): compiles these headers, and those of the standard library that
# most files use, once for the target, which takes a third off its time. A file still names every header
# that it uses: the presets dev and tidy, and builds with a launcher such as ccache, which keeps single
# files, compile nothing in advance.
if(CMAKE_CXX_COMPILER_LAUNCHER)
    set(CMAKE_DISABLE_PRECOMPILE_HEADERS ON)
endif()
function(morphray_precompile target)
    target_precompile_headers(${target} PRIVATE <algorithm> <array> <cmath> <cstdint> <cstring>
        <functional> <limits> <map> <memory> <optional> <span> <string> <string_view> <utility> <vector>
        <fmt/format.h> ${ARGN})
endfunction()

# morphray_compile_folders(TARGET): compiles the sources of each folder of the target as one, which takes
# half its time where headers cost most. So names without linkage are unique in a folder. Where nothing
# is compiled in advance, files are compiled one by one. To be called when the target has its sources.
function(morphray_compile_folders target)
    if(CMAKE_DISABLE_PRECOMPILE_HEADERS)
        return()
    endif()
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
    get_target_property(sources ${target} SOURCES)
    foreach(source IN LISTS sources)
        if(source MATCHES "^(.*)/[^/]*[.]cpp$")
            string(MAKE_C_IDENTIFIER "${CMAKE_MATCH_1}" folder)
            set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${folder})
        endif()
    endforeach()
endfunction()
