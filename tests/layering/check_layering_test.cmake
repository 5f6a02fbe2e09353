# cmake -D CHECKER=check_layering.cmake -D SCRATCH=folder -P check_layering_test.cmake: the checker
# must reject a planted violation of each of its rules. The test `layering` is of a sound tree.
cmake_minimum_required(VERSION 3.25)

set(failures "")

# check(file include...): the checker must name `file`, which has these includes, in a tree of sound files.
function(check file)
    file(REMOVE_RECURSE ${SCRATCH})
    file(WRITE ${SCRATCH}/common/interop/a.h "#include \"common/interop/b.h\"\n#include <cmath>\n")
    file(WRITE ${SCRATCH}/app/cli/command_line.cpp "#include <CLI/CLI.hpp>\n#include \"app/base/a.h\"\n")
    file(WRITE ${SCRATCH}/cpu/packet/a.h "#include \"cpu/simd/a.h\"\n")
    set(text "")
    foreach(include IN LISTS ARGN)
        string(APPEND text "#include ${include}\n")
    endforeach()
    file(WRITE ${SCRATCH}/${file} "// A comment.\n${text}int x;\n")
    execute_process(COMMAND ${CMAKE_COMMAND} -D ROOT=${SCRATCH} -P ${CHECKER}
                    RESULT_VARIABLE result ERROR_VARIABLE output OUTPUT_QUIET)
    if(result EQUAL 0 OR NOT output MATCHES "layering:" OR NOT output MATCHES "${file}")
        list(APPEND failures "${file} with ${ARGN}: not rejected (${output})")
        set(failures "${failures}" PARENT_SCOPE)
    endif()
endfunction()

# The tables of rooms, of tests' rooms, of the program's folders, and of its engine.
check(cpu/x.cpp "<gpu/y.h>")
check(tests/common/x.cpp "\"app/y.h\"")
check(app/base/x.h "\"app/cli/y.h\"")
check(app/view/x.cpp "\"common/update/tree_updater.h\"")
check(app/commands/x.cpp "\"library/src/scene_impl.h\"")
# The orders of folders.
check(cpu/simd/x.h "\"cpu/packet/a.h\"")
check(scenes/obj/x.h "\"scenes/sequence/y.h\"")
# Places of libraries, and paths.
check(app/x.cpp "<volk/volk.h>")
check(tests/x.cpp "<stb/stb_image_write.h>")
check(common/x.cpp "\"../cpu/y.h\"")
# Names in comments; the variable keeps them from being taken for names in this file.
set(removed Removed)
check(common/x.h "<cmath> // as `common/${removed}.h` has it")
check(common/x.h "<cmath> // a part of `k${removed}`")
check(common/x.h "<cmath> // a part of `Frame::has${removed}`")

file(REMOVE_RECURSE ${SCRATCH})
if(failures)
    list(JOIN failures "\n" text)
    message(FATAL_ERROR "${text}")
endif()
