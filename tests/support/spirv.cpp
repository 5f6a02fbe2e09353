#include "tests/support/spirv.h"

#include <algorithm>
#include <array>

namespace mray::test {
namespace {

std::string text_of(std::span<const std::uint32_t> words) {
    std::string text;
    for (const std::uint32_t word : words) {
        for (std::uint32_t shift = 0; shift < 32; shift += 8) {
            const char c = static_cast<char>(word >> shift & 0xFF);
            if (c == '\0') return text;
            text += c;
        }
    }
    return text;
}

/// Instructions that compute nothing (declarations, memory, control flow, texel fetches, atomics
/// on integers), and those that every device computes equally.
bool is_exact(std::uint32_t opcode) {
    constexpr std::array<std::array<std::uint32_t, 2>, 20> kRanges = {{
        {1, 1},      // a value that is not used
        {3, 8},      // names and sources
        {10, 22},    // extensions, entry points, types up to float
        {22, 33},    // types
        {41, 46},    // constants
        {48, 51},    // specialisation constants
        {54, 57},    // functions
        {59, 62},    // variables, loads, stores
        {65, 66},    // access chains
        {71, 72},    // decorations
        {77, 83},    // vectors and composites
        {95, 99},    // texels
        {100, 100},  // images
        {109, 112},  // conversions between 32-bit types
        {124, 135},  // bit casts, + - * and integer division
        {137, 139},  // integer remainders
        {142, 142},  // vector times scalar
        {164, 191},  // logic, selection, comparisons
        {194, 205},  // bits
        {224, 255},  // barriers, atomics, control flow
    }};
    return std::any_of(kRanges.begin(), kRanges.end(),
                       [&](const auto& r) { return opcode >= r[0] && opcode <= r[1]; });
}

/// Whether it is FAbs, FMin, UMin, FMax, UMax or FindILsb of GLSL.std.450.
bool is_exact_extended(std::uint32_t number) {
    constexpr std::uint32_t kAllowed[] = {4, 37, 38, 40, 41, 73};
    return std::find(std::begin(kAllowed), std::end(kAllowed), number) != std::end(kAllowed);
}

}  // namespace

SpirvModule::SpirvModule(std::span<const std::uint32_t> words)
    : instructions_(gpu::read_spirv(words)) {}

bool SpirvModule::has_execution_mode(std::uint32_t mode, std::uint32_t argument) const {
    return std::any_of(instructions_.begin(), instructions_.end(), [&](const auto& i) {
        return i.opcode == kOpExecutionMode && i.operands.size() == 3 && i.operands[1] == mode &&
               i.operands[2] == argument;
    });
}

std::set<std::uint32_t> SpirvModule::decorated(std::uint32_t decoration) const {
    std::set<std::uint32_t> results;
    for (const gpu::SpirvInstruction& i : instructions_) {
        if (i.opcode == kOpDecorate && i.operands[1] == decoration) results.insert(i.operands[0]);
    }
    return results;
}

std::map<std::string, std::uint32_t> SpirvModule::member_offsets(const std::string& type) const {
    std::set<std::uint32_t> candidates;
    for (const gpu::SpirvInstruction& i : instructions_) {
        if (i.opcode == kOpName && text_of(i.operands.subspan(1)) == type) {
            candidates.insert(i.operands[0]);
        }
    }
    std::map<std::uint32_t, std::map<std::uint32_t, std::string>> names;
    std::map<std::uint32_t, std::map<std::uint32_t, std::uint32_t>> offsets;
    for (const gpu::SpirvInstruction& i : instructions_) {
        if (i.opcode == kOpMemberName) {
            names[i.operands[0]][i.operands[1]] = text_of(i.operands.subspan(2));
        } else if (i.opcode == kOpMemberDecorate && i.operands[2] == kOffset) {
            offsets[i.operands[0]][i.operands[1]] = i.operands[3];
        }
    }
    std::map<std::string, std::uint32_t> result;
    for (const std::uint32_t id : candidates) {
        for (const auto& [member, offset] : offsets[id]) result[names[id][member]] = offset;
    }
    return result;
}

std::vector<std::string> inexact_operations(const SpirvModule& module) {
    std::vector<std::string> found;
    const std::set<std::uint32_t> uncontracted = module.decorated(kNoContraction);
    for (const gpu::SpirvInstruction& i : module.instructions()) {
        const bool rounds = i.opcode == kOpFAdd || i.opcode == kOpFSub || i.opcode == kOpFMul ||
                            i.opcode == kOpVectorTimesScalar;
        // What is computed when a kernel is specialised is on integers.
        const std::uint32_t opcode = i.opcode == kOpSpecConstantOp ? i.operands[2] : i.opcode;
        if (!is_exact(opcode)) {
            found.push_back("opcode " + std::to_string(opcode));
        } else if (i.opcode == kOpExtInst && !is_exact_extended(i.operands[3])) {
            found.push_back("extended instruction " + std::to_string(i.operands[3]));
        } else if (rounds && uncontracted.count(i.operands[1]) == 0) {
            found.push_back("opcode " + std::to_string(i.opcode) + " may be contracted");
        }
    }
    return found;
}

}  // namespace mray::test
