# Rules for `cmake --install`, by component:
#
#   library   the shared library
#   dev       headers, the packages for CMake and pkg-config, examples
#   program   the program and those that it starts, its man page
#   embree    the libraries in place of Embree's, if they are built (library/embree/CMakeLists.txt)
#   python    the Python package, if it is built (library/python/CMakeLists.txt); otherwise an error
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# All that is installed, and no test.
add_custom_target(morphray_install_files)
add_dependencies(morphray_install_files morphray_shared)

install(TARGETS morphray_shared EXPORT morphray_shared_targets
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT dev)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT library)
install(DIRECTORY library/include/morphray DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev
    FILES_MATCHING PATTERN *.hpp)
install(FILES ${PROJECT_BINARY_DIR}/generated/morphray/version.hpp
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/morphray COMPONENT dev)
install(DIRECTORY library/examples DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT dev
    PATTERN __pycache__ EXCLUDE)

# The package for CMake.
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/morphray)
set(package_build ${PROJECT_BINARY_DIR}/package)
configure_package_config_file(cmake/morphrayConfig.cmake.in ${package_build}/morphrayConfig.cmake
    INSTALL_DESTINATION ${package_folder} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${package_build}/morphrayConfigVersion.cmake
    COMPATIBILITY SameMinorVersion)
install(FILES ${package_build}/morphrayConfig.cmake ${package_build}/morphrayConfigVersion.cmake
    DESTINATION ${package_folder} COMPONENT dev)
install(EXPORT morphray_shared_targets NAMESPACE morphray:: FILE morphray_shared.cmake
    DESTINATION ${package_folder} COMPONENT dev)

# The package for pkg-config, which finds the others from where it lies.
set(pc_folder ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH pc_prefix ${pc_folder} ${CMAKE_INSTALL_PREFIX})
file(RELATIVE_PATH pc_libdir ${CMAKE_INSTALL_PREFIX} ${CMAKE_INSTALL_FULL_LIBDIR})
file(RELATIVE_PATH pc_includedir ${CMAKE_INSTALL_PREFIX} ${CMAKE_INSTALL_FULL_INCLUDEDIR})
string(REGEX REPLACE "/$" "" pc_prefix ${pc_prefix})
configure_file(cmake/morphray.pc.in ${package_build}/morphray.pc @ONLY)
install(FILES ${package_build}/morphray.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
    COMPONENT dev)

foreach(version 3 4)
    if(TARGET morphray_embree${version})
        add_dependencies(morphray_install_files morphray_embree${version})
    endif()
endforeach()

if(TARGET morphray)
    install(TARGETS morphray RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
    # Users start it through `morphray chart`, so it is in no folder of PATH.
    install(TARGETS morphray_chart
        RUNTIME DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/morphray COMPONENT program)
    install(DIRECTORY scenes/examples/
        DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/morphray/scenes COMPONENT program)
    install(FILES report/plot.py
        DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/morphray COMPONENT program)
    add_dependencies(morphray_install_files morphray_programs)
    # The man page is the program's help (Debian: help2man).
    find_program(MORPHRAY_HELP2MAN help2man)
    if(MORPHRAY_HELP2MAN)
        set(page ${PROJECT_BINARY_DIR}/morphray.1)
        add_custom_command(OUTPUT ${page}
            COMMAND ${MORPHRAY_HELP2MAN} --no-info --name "ray tracer for deforming triangle scenes"
                    --output ${page} $<TARGET_FILE:morphray>
            DEPENDS morphray COMMENT "Writing the man page" VERBATIM)
        add_custom_target(morphray_manual ALL DEPENDS ${page})
        add_dependencies(morphray_install_files morphray_manual)
        install(FILES ${page} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
    endif()
endif()
