# Flags that every target of the project compiles with.
add_library(morphray_options INTERFACE)
target_include_directories(morphray_options INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(morphray_options INTERFACE
    # The hit rule rounds after every operation: a fused multiply-add would change bits and lose the
    # antisymmetry that makes shared edges watertight (docs/design/arithmetic.md).
    -ffp-contract=off
    -fno-fast-math
    # g++ collects garbage from 512 MiB on, not from 128: a twentieth less time.
    $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=524288>
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
    $<$<BOOL:${MORPHRAY_WERROR}>:-Werror>)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64|i.86")
    # g++ 12 copies pairs of floats by MMX registers, and leaves the x87 unit unusable after that.
    target_compile_options(morphray_options INTERFACE -mno-mmx)
endif()
if(MORPHRAY_SANITIZE)
    target_compile_options(morphray_options INTERFACE
        -fsanitize=${MORPHRAY_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
    target_link_options(morphray_options INTERFACE -fsanitize=${MORPHRAY_SANITIZE})
    target_compile_definitions(morphray_options INTERFACE MORPHRAY_SANITIZED)
endif()
