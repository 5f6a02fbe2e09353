// A planted fault: a constant of the shared text differs in one ulp.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/base/exact.glsl"

#include "common/interop/constants.h"
#define kSurfaceOffset 3.8146977e-06f

#include "tests/shaders/evaluate.glsl"
