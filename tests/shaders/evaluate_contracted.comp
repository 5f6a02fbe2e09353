// A planted fault: the compiler may contract and reassociate.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/exact.glsl"

#include "common/interop/platform.h"
#undef PRECISE
#define PRECISE

#include "tests/shaders/evaluate.glsl"
