# cmake -D HEADERS=arithmetic.h,hit_rule.h -D OUTPUT=file -D FUNCTIONS=a,b -P extract.cmake: these
# functions of interop headers as templates over their float type, so that proofs run the text of the
# code.
# 4097, Veltkamp's constant for 24 bits, becomes Real::splitter().
string(REPLACE "," ";" headers "${HEADERS}")
set(text "")
foreach(header IN LISTS headers)
    file(READ ${header} more)
    string(APPEND text "${more}")
endforeach()
string(REPLACE "," ";" functions "${FUNCTIONS}")
string(REPLACE ";" "<semicolon>" text "${text}")
set(result "// Made by lab/proofs/extract.cmake from ${HEADERS}.
#pragma once
#include \"common/interop/constants.h\"
namespace mray::proofs {
")
foreach(function IN LISTS functions)
    string(REGEX MATCH "SHARED Float ${function}[(].*" rest "${text}")
    if(NOT rest)
        message(FATAL_ERROR "no function ${function} in ${HEADERS}")
    endif()
    string(FIND "${rest}" "\n}\n" end)
    math(EXPR end "${end} + 3")
    string(SUBSTRING "${rest}" 0 ${end} body)
    string(REPLACE "SHARED Float" "template <class Real>\nReal" body "${body}")
    string(REPLACE "PRECISE Float" "const Real" body "${body}")
    string(REGEX REPLACE "Float ([a-z_]+ =)" "const Real \\1" body "${body}")
    string(REGEX REPLACE "Float ([a-z_]+[,)])" "Real \\1" body "${body}")
    string(REPLACE "4097.0f" "Real::splitter()" body "${body}")
    string(REPLACE "0.0f" "Real(0)" body "${body}")
    string(REGEX REPLACE "(k[A-Z][A-Za-z]+)" "Real(\\1)" body "${body}")
    string(REPLACE "<semicolon>" ";" body "${body}")
    string(APPEND result "\n${body}")
endforeach()
string(APPEND result "}  // namespace mray::proofs\n")
file(WRITE ${OUTPUT} "${result}")
