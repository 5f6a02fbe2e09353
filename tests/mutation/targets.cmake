# Included after project(): SIMD code is compiled for AVX2 and for none, where that is possible.
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
    # All but bit 9 (AVX2) and bit 62 (HWY_SCALAR, which compiles much faster than HWY_EMU128).
    cmake_language(DEFER CALL target_compile_options morphray_simd INTERFACE
        -UHWY_DISABLED_TARGETS -DHWY_DISABLED_TARGETS=0x3ffffffffffffdff -DHWY_BROKEN_EMU128=1)
endif()
