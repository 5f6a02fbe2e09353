// Questions about a compiled kernel, answered from its SPIR-V.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "gpu/vulkan/pipeline.h"

namespace mray::test {

/// Opcodes and decorations by their numbers in the SPIR-V specification.
enum SpirvOp : std::uint32_t {
    kOpName = 5,
    kOpMemberName = 6,
    kOpExtInst = 12,
    kOpSpecConstantOp = 52,
    kOpExecutionMode = 16,
    kOpCapability = 17,
    kOpTypeStruct = 30,
    kOpDecorate = 71,
    kOpMemberDecorate = 72,
    kOpFAdd = 129,
    kOpFSub = 131,
    kOpFMul = 133,
    kOpVectorTimesScalar = 142,
};
enum SpirvDecoration : std::uint32_t { kArrayStride = 6, kOffset = 35, kNoContraction = 42 };

/// A view of a module whose words outlive it. Throws Error(kInternal) on words that are not a
/// module.
class SpirvModule {
public:
    explicit SpirvModule(std::span<const std::uint32_t> words);

    const std::vector<gpu::SpirvInstruction>& instructions() const { return instructions_; }
    bool has_execution_mode(std::uint32_t mode, std::uint32_t argument) const;
    /// The results decorated so.
    std::set<std::uint32_t> decorated(std::uint32_t decoration) const;

    /// Byte offsets by member name of the struct type of that name that has a layout; empty if
    /// there is none.
    std::map<std::string, std::uint32_t> member_offsets(const std::string& type) const;

private:
    std::vector<gpu::SpirvInstruction> instructions_;
};

/// Operations of a kernel whose rounding differs between devices, one line each; empty if there are
/// none. Floats may be added, subtracted and multiplied without contraction, compared, selected and
/// converted.
std::vector<std::string> inexact_operations(const SpirvModule& module);

}  // namespace mray::test
