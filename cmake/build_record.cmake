# The Debian packages that a build uses: those of the kinds build, chart and view of cmake/packages.txt, where the
# build has charts and the viewer, those of its optional parts, and the compiler's own. Their versions are asked for
# on every build, because packages are upgraded without a new configuration, and written when they change. For
# another architecture there are none, because this machine's dpkg does not know what the compiler takes.
set(kinds build)
if(TARGET morphray_chart)
    list(APPEND kinds chart)
endif()
if(MORPHRAY_HAS_VIEW)
    list(APPEND kinds view)
endif()
list(JOIN kinds "|" kinds)
file(STRINGS cmake/packages.txt lines REGEX "^(${kinds}) ")
list(TRANSFORM lines REPLACE "^[a-z]+ " "" OUTPUT_VARIABLE MORPHRAY_BUILD_PACKAGES)
if(TARGET morphray_embree OR TARGET morphray_embree3 OR TARGET morphray_embree4)
    list(APPEND MORPHRAY_BUILD_PACKAGES libembree-dev)
endif()
if(TARGET morphray_python)
    list(APPEND MORPHRAY_BUILD_PACKAGES pybind11-dev python3-dev)
endif()
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS cmake/packages.txt)

find_program(MORPHRAY_DPKG_QUERY dpkg-query)
mark_as_advanced(MORPHRAY_DPKG_QUERY)
if(NOT MORPHRAY_DPKG_QUERY OR CMAKE_CROSSCOMPILING)
    set(MORPHRAY_BUILD_PACKAGES)
else()
    file(REAL_PATH ${CMAKE_CXX_COMPILER} compiler)
    execute_process(COMMAND ${MORPHRAY_DPKG_QUERY} -S ${compiler}
        OUTPUT_VARIABLE owner OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    if(owner MATCHES "^([-+.a-z0-9]+)(:[a-z0-9]+)?: ")
        list(APPEND MORPHRAY_BUILD_PACKAGES ${CMAKE_MATCH_1})
    endif()
endif()
list(REMOVE_DUPLICATES MORPHRAY_BUILD_PACKAGES)
list(SORT MORPHRAY_BUILD_PACKAGES)

if(TARGET morphray_report)
    set(header ${PROJECT_BINARY_DIR}/generated/common/report/build_packages.h)
    list(JOIN MORPHRAY_BUILD_PACKAGES "," names)
    add_custom_target(morphray_build_packages
        COMMAND ${CMAKE_COMMAND} -D NAMES=${names} -D DPKG_QUERY=${MORPHRAY_DPKG_QUERY}
            -D TEMPLATE=${PROJECT_SOURCE_DIR}/common/report/build_packages.h.in -D OUTPUT=${header}
            -P ${PROJECT_SOURCE_DIR}/cmake/build_packages.cmake
        BYPRODUCTS ${header}
        COMMENT "Checking the packages"
        VERBATIM)
    add_dependencies(morphray_report morphray_build_packages)
endif()
