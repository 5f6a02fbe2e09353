// The first include of every kernel: the modes that make + - * on floats round equally on every
// device (Vulkan specification, "Precision and Operation of SPIR-V Instructions"). Mode 4462 is
// RoundingModeRTE, 4461 SignedZeroInfNanPreserve, each for 32 bits; 4467 and 4466 are their
// capabilities.
#extension GL_EXT_spirv_intrinsics : require

spirv_execution_mode(extensions = ["SPV_KHR_float_controls"], capabilities = [4467], 4462, 32);
spirv_execution_mode(extensions = ["SPV_KHR_float_controls"], capabilities = [4466], 4461, 32);
