#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"

#include "tests/shaders/evaluate.glsl"
