# cmake -DINPUT=kernel.spv -DHEADER=kernel_spirv.h -DNAME=k_kernel_spirv -P header.cmake
# writes HEADER, the words of INPUT as an array NAME.
cmake_minimum_required(VERSION 3.25)
file(READ ${INPUT} words HEX)
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${words}")
string(REPEAT "0x........," 8 line)
string(REGEX REPLACE "(${line})" "\\1\n" words "${words}")
file(WRITE ${HEADER} "#pragma once\nconst uint32_t ${NAME}[] = {\n${words}};\n")
