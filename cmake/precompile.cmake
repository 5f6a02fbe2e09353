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
