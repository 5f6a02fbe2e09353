# As cmake/aarch64/toolchain.cmake, for wheels. Python is a script that calls the emulator by itself, and
# FindPython.cmake asks no interpreter of another processor where its headers are.
include(${CMAKE_CURRENT_LIST_DIR}/../aarch64/toolchain.cmake)
unset(CMAKE_CROSSCOMPILING_EMULATOR)
file(GLOB Python_INCLUDE_DIR ${CMAKE_SYSROOT}/usr/include/python3.*)
