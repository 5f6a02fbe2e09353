# cmake -DINPUT=raw.spv -DOUTPUT=kernel.spv -DHEADER=kernel_spirv.h -DNAME=k_kernel_spirv
#       [-DOPT=spirv-opt -DDIS=spirv-dis -DAS=spirv-as] -P optimise.cmake
# writes OUTPUT, the optimised INPUT, and HEADER, the same words as an array NAME. Without OPT the
# words stay as they are.
#
# 1. spirv-opt leaves local variables alone in a module with SPV_KHR_float_controls. So the modes of
#    shaders/base/exact.glsl are taken out first and put back at the end.
# 2. spirv-opt neither folds nor fuses what is decorated NoContraction. Its loop-unroll loses the
#    decoration in copies of a loop's body, and afterwards products and sums would become Fma. So
#    all arithmetic is decorated, once more after loops are unrolled.
# tests/shaders/exactness_test.cpp checks the results.
cmake_minimum_required(VERSION 3.25)

set(modes SignedZeroInfNanPreserve RoundingModeRTE)
set(clean --eliminate-dead-code-aggressive)
set(to_values --convert-local-access-chains --eliminate-local-single-block
    --eliminate-local-single-store ${clean} --ssa-rewrite ${clean})
# The passes of -O, in its order.
set(until_unroll --eliminate-dead-branches --merge-return --inline-entry-points-exhaustive
    --eliminate-dead-functions ${clean} --private-to-local --eliminate-local-single-block
    --eliminate-local-single-store ${clean} --scalar-replacement=100 ${to_values} --ccp ${clean})
set(after_unroll --eliminate-dead-branches --redundancy-elimination --combine-access-chains
    --simplify-instructions --scalar-replacement=100 ${to_values} --vector-dce
    --eliminate-dead-inserts --eliminate-dead-branches --simplify-instructions --if-conversion
    --copy-propagate-arrays --reduce-load-size ${clean} --merge-blocks --redundancy-elimination
    --eliminate-dead-branches --merge-blocks --simplify-instructions --strip-debug --compact-ids)

function(run)
    execute_process(COMMAND ${ARGN} RESULT_VARIABLE result ERROR_VARIABLE message)
    if(NOT result EQUAL 0)
        message(FATAL_ERROR "${ARGN}: ${message}")
    endif()
endfunction()

function(disassemble file)
    run(${DIS} --raw-id --no-header ${file} -o ${file}.asm)
    file(READ ${file}.asm text)
    file(REMOVE ${file}.asm)
    set(text "${text}" PARENT_SCOPE)
endfunction()

function(assemble text file)
    file(WRITE ${file}.asm "${text}")
    run(${AS} --preserve-numeric-ids --target-env vulkan1.1 ${file}.asm -o ${file})
    file(REMOVE ${file}.asm)
endfunction()

function(optimise file)
    run(${OPT} --target-env=vulkan1.1 ${ARGN} ${file} -o ${file})
endfunction()

function(remove_modes file)
    disassemble(${file})
    list(JOIN modes "|" names)
    string(REGEX REPLACE "[^\n]*(\"SPV_KHR_float_controls\"|${names})[^\n]*\n" "" text "${text}")
    assemble("${text}" ${file})
endfunction()

# Capabilities come first, then extensions; further modes of execution follow the local size.
function(add_modes file)
    disassemble(${file})
    foreach(mode ${modes})
        string(PREPEND text "OpCapability ${mode}\n")
        string(REGEX REPLACE "(OpExecutionMode %[0-9]+) LocalSize[^\n]*\n" "\\0\\1 ${mode} 32\n"
               text "${text}")
    endforeach()
    string(REGEX REPLACE "(OpCapability [^\n]*\n)([^\n]*Op(Extension|ExtInstImport))"
           "\\1OpExtension \"SPV_KHR_float_controls\"\n\\2" text "${text}")
    assemble("${text}" ${file})
endfunction()

function(decorate_arithmetic file)
    disassemble(${file})
    string(REGEX REPLACE "[^\n]*OpDecorate %[0-9]+ NoContraction\n" "" text "${text}")
    string(REGEX MATCHALL "%[0-9]+ = Op(F(Add|Sub|Mul|Div|Rem|Mod|Negate)|VectorTimes(Scalar|Matrix)|MatrixTimes(Scalar|Vector|Matrix)|OuterProduct|Dot) "
           results "${text}")
    list(TRANSFORM results REPLACE "^(%[0-9]+) .*" "OpDecorate \\1 NoContraction\n")
    list(JOIN results "" decorations)
    string(REGEX MATCH "[^\n]*OpDecorate " first "${text}")
    string(FIND "${text}" "${first}" at)
    string(SUBSTRING "${text}" 0 ${at} before)
    string(SUBSTRING "${text}" ${at} -1 after)
    assemble("${before}${decorations}${after}" ${file})
endfunction()

file(COPY_FILE ${INPUT} ${OUTPUT})
if(OPT)
    remove_modes(${OUTPUT})
    decorate_arithmetic(${OUTPUT})
    optimise(${OUTPUT} ${until_unroll} --loop-unroll)
    decorate_arithmetic(${OUTPUT})
    optimise(${OUTPUT} ${after_unroll})
    add_modes(${OUTPUT})
endif()

file(READ ${OUTPUT} words HEX)
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${words}")
string(REPEAT "0x........," 8 line)
string(REGEX REPLACE "(${line})" "\\1\n" words "${words}")
file(WRITE ${HEADER} "#pragma once\nconst uint32_t ${NAME}[] = {\n${words}};\n")
