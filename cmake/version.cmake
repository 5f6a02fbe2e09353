# cmake -D VERSION=1.2.3 -D ROOT=checkout -D OUTPUT=version.h -P version.cmake: writes the header
# when its content changes, so that only its few includers are compiled again.
set(VERSION_DETAIL ${VERSION})
# `git archive` replaces this by the tag (.gitattributes).
set(commit "$Format:%(describe:tags)$")
# A release archive unpacked inside some other repository must not be described by that one.
cmake_path(GET ROOT PARENT_PATH above)
set(ENV{GIT_CEILING_DIRECTORIES} ${above})
execute_process(
    # The checkout of another user, as root of a container finds it, is built all the same.
    COMMAND git -c safe.directory=* describe --tags --always --dirty
    WORKING_DIRECTORY ${ROOT}
    RESULT_VARIABLE result OUTPUT_VARIABLE described
    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(result EQUAL 0)
    set(commit ${described})
endif()
if(commit MATCHES "^[-+._/A-Za-z0-9]+$")
    set(VERSION_DETAIL "${VERSION} (${commit})")
endif()
configure_file(${ROOT}/common/version.h.in ${OUTPUT} @ONLY)
