# Debian packages by CPack, one for each component of cmake/install.cmake; a component "python",
# with MORPHRAY_PYTHON=ON, becomes python3-morphray. `cmake/package/run` makes them.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME morphray)
set(CPACK_PACKAGE_VENDOR "the morphray authors")
set(MORPHRAY_PACKAGER "The morphray authors <packages@morphray.example>" CACHE STRING
    "Who the packages name as their maintainer")
set(CPACK_PACKAGE_CONTACT "${MORPHRAY_PACKAGER}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)

set(CPACK_COMPONENTS_ALL library dev program)
if(TARGET morphray_python AND NOT MORPHRAY_PYTHON STREQUAL "AUTO")
    list(APPEND CPACK_COMPONENTS_ALL python)
    # An extension module is for one minor version of Debian's interpreter.
    execute_process(COMMAND /usr/bin/python3 -c
        "import sys; v = sys.version_info; print(f'python3 (>= {v[0]}.{v[1]}), python3 (<< {v[0]}.{v[1] + 1})')"
        OUTPUT_VARIABLE interpreter OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
    set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "${interpreter}, python3-numpy")
endif()
if(TARGET morphray_embree3 OR TARGET morphray_embree4)
    list(APPEND CPACK_COMPONENTS_ALL embree)
endif()
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)

set(about "morphray traces rays and renders images of triangle meshes that deform, on
the CPU and on any Vulkan 1.1 device, from one bounding volume hierarchy that
is refitted from pose to pose. Results are equal bit by bit on every machine,
instruction set and device.
")

# morphray_package(COMPONENT NAME SECTION TEXT): its description is what all have in common, and TEXT.
macro(morphray_package component name section text)
    set(CPACK_DEBIAN_${component}_PACKAGE_NAME ${name})
    set(CPACK_DEBIAN_${component}_PACKAGE_SECTION ${section})
    set(CPACK_DEBIAN_${component}_DESCRIPTION "${about}\n${text}")
endmacro()

# Debian's rules: the name of the shared library's package has the number of its soname.
morphray_package(LIBRARY libmorphray${PROJECT_VERSION_MAJOR} libs "This package has the shared library.")
# It is loaded when it is there.
set(CPACK_DEBIAN_LIBRARY_PACKAGE_RECOMMENDS libvulkan1)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SUGGESTS "mesa-vulkan-drivers | vulkan-icd")
# CPack's own scripts call ldconfig, where a trigger is asked for.
set(control ${PROJECT_BINARY_DIR}/package/control)
file(WRITE ${control}/triggers "activate-noawait ldconfig\n")
file(WRITE ${control}/shlibs
    "libmorphray ${PROJECT_VERSION_MAJOR} libmorphray${PROJECT_VERSION_MAJOR} (>= ${PROJECT_VERSION})\n")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${control}/triggers ${control}/shlibs)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_STRICT_PERMISSION ON)

morphray_package(DEV libmorphray-dev libdevel
    "This package has the headers, packages for CMake and pkg-config, and examples.")
set(CPACK_COMPONENT_DEV_DEPENDS library)
set(CPACK_DEBIAN_DEV_PACKAGE_SHLIBDEPS OFF)

morphray_package(PROGRAM morphray graphics
    "This package has the program, which renders animations, compares backends and\nmeasures updates.")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS libvulkan1)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "python3-matplotlib, mesa-vulkan-drivers | vulkan-icd")

morphray_package(EMBREE morphray-embree graphics
    "This package runs programs that use Embree, such as Blender and Open3D, with\nmorphray in its place.")
# Its libraries are found by no linker, so it names what they need itself.
set(CPACK_DEBIAN_EMBREE_PACKAGE_SHLIBDEPS OFF)
set(CPACK_COMPONENT_EMBREE_DEPENDS library)
set(CPACK_DEBIAN_EMBREE_PACKAGE_DEPENDS "libc6, libgcc-s1, libstdc++6")

morphray_package(PYTHON python3-morphray python "This package has the module for Python 3.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS libvulkan1)
include(CPack)
