// A planted fault: the compiler may contract and reassociate, and need not keep signed zeros.
#version 460
#extension GL_GOOGLE_include_directive : require

#include "common/interop/platform.h"
#undef PRECISE
#define PRECISE

#include "tests/shaders/evaluate.glsl"
