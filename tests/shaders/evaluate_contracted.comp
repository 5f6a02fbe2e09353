// What spirv_test.cpp must find: the compiler may contract and reassociate, and need not keep zeros' signs.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "common/interop/platform.h"
#undef PRECISE
#define PRECISE

#include "tests/shaders/evaluate.glsl"
