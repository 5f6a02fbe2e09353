# CPack runs this when the components are staged: each package gets what Debian's policy asks for,
# and what it has linked is checked to be hardened.
set(source ${CPACK_MORPHRAY_SOURCE_DIR})
file(READ ${source}/LICENSE license)
string(REGEX REPLACE "^MIT License\n+" "" license "${license}")
string(REGEX MATCH "Copyright \\(c\\) ([^\n]*)\n+(.*)" unused "${license}")
set(holder "${CMAKE_MATCH_1}")
string(STRIP "${CMAKE_MATCH_2}" text)
string(REGEX REPLACE "\n\n" "\n.\n" text "${text}")
string(REPLACE "\n" "\n " text "${text}")

# One date for all, which does not change with the time of the build.
execute_process(COMMAND git -C ${source} log -1 --format=%cD
    OUTPUT_VARIABLE date OUTPUT_STRIP_TRAILING_WHITESPACE RESULT_VARIABLE result ERROR_QUIET)
if(NOT result EQUAL 0)
    execute_process(COMMAND date -R -r ${source}/CHANGELOG.md
        OUTPUT_VARIABLE date OUTPUT_STRIP_TRAILING_WHITESPACE)
endif()
execute_process(COMMAND git -C ${source} rev-parse HEAD
    OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)

foreach(component IN LISTS CPACK_COMPONENTS_ALL)
    string(TOUPPER ${component} key)
    set(package ${CPACK_DEBIAN_${key}_PACKAGE_NAME})
    set(staged ${CPACK_TEMPORARY_DIRECTORY}/${component}/usr)
    set(documents ${staged}/share/doc/${package})
    file(MAKE_DIRECTORY ${documents})
    # The copyright file has it.
    file(REMOVE ${staged}/share/doc/morphray/LICENSE)
    file(WRITE ${documents}/copyright
"Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: morphray

Files: *
Copyright: ${holder}
License: Expat

License: Expat
 ${text}
")
    file(WRITE ${documents}/changelog.Debian
"morphray (${CPACK_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}) unstable; urgency=medium

  * Made by cmake/package/run. The changes of the library are in changelog.gz.

 -- ${CPACK_PACKAGE_CONTACT}  ${date}
")
    configure_file(${source}/CHANGELOG.md ${documents}/changelog COPYONLY)
    file(GLOB manuals ${staged}/share/man/man1/*.1)
    # -n: no times, so that equal inputs make equal packages.
    execute_process(COMMAND gzip -9nf ${documents}/changelog ${documents}/changelog.Debian ${manuals}
        COMMAND_ERROR_IS_FATAL ANY)
    file(GLOB_RECURSE archives ${staged}/lib/*.a)
    if(archives)
        execute_process(COMMAND strip --strip-debug --enable-deterministic-archives
            --remove-section=.comment ${archives} COMMAND_ERROR_IS_FATAL ANY)
    endif()
    execute_process(COMMAND ${source}/cmake/package/check_hardening.sh ${staged}
        OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
    file(CHMOD_RECURSE ${documents}
        FILE_PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ
        DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE
            GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
    file(GLOB folder ${staged}/share/doc/morphray/*)
    if(NOT folder AND NOT package STREQUAL "morphray")
        file(REMOVE_RECURSE ${staged}/share/doc/morphray)
    endif()
endforeach()
