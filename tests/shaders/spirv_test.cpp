// The SPIR-V of every kernel: float modes, exact operations, resources as the host reads them, and
// the bytes of the structs that host and kernels share.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "common/base/errors.h"
#include "gpu/limits.h"
#include "gpu/vulkan/pipeline.h"
#include "shaders/kernel_interface.h"
#include "shaders/morphray_kernels.h"
#include "tests/shaders/evaluate_spirv.h"
#include "tests/shaders/layout_spirv.h"

namespace mray::test {
namespace {

// Opcodes by their numbers in the SPIR-V specification.
enum SpirvOp : std::uint32_t {
    kOpName = 5,
    kOpMemberName = 6,
    kOpExtInst = 12,
    kOpSpecConstantOp = 52,
    kOpExecutionMode = 16,
    kOpCapability = 17,
    kOpDecorate = 71,
    kOpMemberDecorate = 72,
    kOpFAdd = 129,
    kOpFSub = 131,
    kOpFMul = 133,
    kOpVectorTimesScalar = 142,
};
enum SpirvDecoration : std::uint32_t { kOffset = 35, kNoContraction = 42 };

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
        {65, 68},    // access chains, lengths of arrays
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

using Offsets = std::map<std::string, std::uint32_t>;

/// Byte offsets by member name of the struct type of that name that has a layout.
Offsets member_offsets(std::span<const std::uint32_t> words, const std::string& type) {
    const std::vector<gpu::SpirvInstruction> instructions = gpu::read_spirv(words);
    std::set<std::uint32_t> candidates;
    for (const gpu::SpirvInstruction& i : instructions) {
        if (i.opcode == kOpName && text_of(i.operands.subspan(1)) == type)
            candidates.insert(i.operands[0]);
    }
    std::map<std::uint32_t, std::map<std::uint32_t, std::string>> names;
    std::map<std::uint32_t, std::map<std::uint32_t, std::uint32_t>> offsets;
    for (const gpu::SpirvInstruction& i : instructions) {
        if (i.opcode == kOpMemberName) {
            names[i.operands[0]][i.operands[1]] = text_of(i.operands.subspan(2));
        } else if (i.opcode == kOpMemberDecorate && i.operands[2] == kOffset) {
            offsets[i.operands[0]][i.operands[1]] = i.operands[3];
        }
    }
    Offsets result;
    for (const std::uint32_t id : candidates)
        for (const auto& [member, offset] : offsets[id]) result[names[id][member]] = offset;
    return result;
}

/// Operations of a kernel whose rounding differs between devices, one line each. Floats may be
/// added, subtracted and multiplied without contraction, compared, selected and converted.
std::vector<std::string> inexact_operations(std::span<const std::uint32_t> words) {
    const std::vector<gpu::SpirvInstruction> instructions = gpu::read_spirv(words);
    std::vector<std::string> found;
    std::set<std::uint32_t> uncontracted;
    for (const gpu::SpirvInstruction& i : instructions)
        if (i.opcode == kOpDecorate && i.operands[1] == kNoContraction)
            uncontracted.insert(i.operands[0]);
    for (const gpu::SpirvInstruction& i : instructions) {
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

struct Kernel {
    const char* name;
    std::span<const std::uint32_t> words;
};

#define KERNEL(name) {#name, k_##name##_spirv},
const Kernel kKernels[] = {MORPHRAY_KERNELS(KERNEL)};
#undef KERNEL

/// The kernels whose bits are those of the CPU.
std::vector<Kernel> exact_kernels() {
    std::vector<Kernel> kernels = {{"evaluate", k_evaluate_spirv}};
    kernels.insert(kernels.end(), std::begin(kKernels), std::end(kKernels));
    return kernels;
}

class ExactKernel : public testing::TestWithParam<Kernel> {};

std::set<std::uint32_t> float_modes(std::span<const std::uint32_t> words) {
    std::set<std::uint32_t> modes;
    for (const gpu::SpirvInstruction& i : gpu::read_spirv(words))
        if (i.opcode == kOpExecutionMode && i.operands.size() == 3 && i.operands[2] == 32)
            modes.insert(i.operands[1]);
    return modes;
}

TEST_P(ExactKernel, RoundsToNearestAndKeepsZerosInfinitiesAndNans) {
    constexpr std::uint32_t kRoundingModeRte = 4462;
    constexpr std::uint32_t kSignedZeroInfNanPreserve = 4461;
    EXPECT_EQ(float_modes(GetParam().words),
              (std::set{kRoundingModeRte, kSignedZeroInfNanPreserve}));
}

TEST_P(ExactKernel, IsAModuleWithoutTheFloatModesToo) {
    const std::vector<std::uint32_t> plain = gpu::without_float_modes(GetParam().words);
    EXPECT_TRUE(float_modes(plain).empty());
    const std::string file = testing::TempDir() + GetParam().name + "_plain.spv";
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(plain.data()),
               static_cast<std::streamsize>(4 * plain.size()));
    EXPECT_EQ(std::system((SPIRV_VAL " --target-env vulkan1.1 '" + file + "'").c_str()), 0);
    std::remove(file.c_str());
}

TEST_P(ExactKernel, ComputesWithExactOperationsOnly) {
    const std::vector<std::string> found = inexact_operations(GetParam().words);
    EXPECT_TRUE(found.empty()) << found.size() << ", the first: " << found.front();
}

/// Whether a capability lets lanes of a subgroup see each other: those of Vulkan 1.1
/// (GroupNonUniform to GroupNonUniformQuad), of the extensions before it, and partitions and
/// rotations.
bool is_of_subgroups(std::uint32_t capability) {
    const bool is_core = capability >= 61 && capability <= 68;
    const bool is_extension = capability == 4423 || capability == 4431 || capability == 5297;
    return is_core || is_extension || capability == 6026;
}

// Lanes of a subgroup may part where control flow is not uniform, so no kernel relies on them.
TEST(Kernels, HaveNoSubgroupCapability) {
    for (const Kernel& kernel : kKernels) {
        for (const gpu::SpirvInstruction& i : gpu::read_spirv(kernel.words)) {
            EXPECT_FALSE(i.opcode == kOpCapability && is_of_subgroups(i.operands[0]))
                << kernel.name << ", capability " << i.operands[0];
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Shaders, ExactKernel, testing::ValuesIn(exact_kernels()),
                         [](const auto& instance) { return std::string(instance.param.name); });

TEST(InexactOperations, AreFound) {
    // A module of one OpFDiv, one OpDot, one OpExtInst Sqrt, and one OpFMul that may be contracted.
    const std::uint32_t words[] = {0x07230203,     0, 0, 9, 0,      //
                                   5u << 16 | 136, 1, 2, 3, 4,      //
                                   5u << 16 | 148, 1, 5, 3, 4,      //
                                   6u << 16 | 12,  1, 6, 7, 31, 3,  //
                                   5u << 16 | 133, 1, 8, 3, 4};
    EXPECT_EQ(inexact_operations(words).size(), 4u);
}

TEST(ReadSpirv, RejectsWordsThatAreNoModule) {
    const std::uint32_t wrong_magic[] = {1, 2, 3, 4, 5};
    const std::uint32_t truncated[] = {0x07230203, 0, 0, 9, 0, 5u << 16 | 136};
    EXPECT_THROW(gpu::read_spirv(wrong_magic), Error);
    EXPECT_THROW(gpu::read_spirv(truncated), Error);
}

constexpr auto kUniformTexels = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
constexpr auto kStorageTexels = VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER;
constexpr auto kStorage = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;

TEST(ShaderInterface, HasTheBindingsOfTheSourceWithTheirTypes) {
    using Bindings = std::vector<gpu::ShaderBinding>;
    EXPECT_EQ(gpu::shader_bindings(k_refit_leaves_spirv),
              (Bindings{{kBindPositions, kUniformTexels},
                        {kBindLeafVertices, kUniformTexels},
                        {kBindLeafParents, kUniformTexels},
                        {kBindNodeWords, kStorageTexels},
                        {kBindLeafWords, kStorageTexels},
                        {kBindGroupWords, kStorageTexels}}));
    EXPECT_EQ(gpu::shader_bindings(k_move_bodies_spirv),
              (Bindings{{kBindMovedPositions, kStorageTexels},
                        {kBindRestPositions, kUniformTexels},
                        {kBindBodies, kUniformTexels}}));
    EXPECT_EQ(gpu::shader_bindings(k_rays_spirv), (Bindings{{kBindNodes, kStorageTexels},
                                                            {kBindLeaves, kStorageTexels},
                                                            {kBindRays, kUniformTexels},
                                                            {kBindHits, kStorage},
                                                            {kBindWork, kStorage},
                                                            {kBindQuarters, kStorageTexels},
                                                            {kBindGroups, kStorageTexels}}));
    for (const gpu::ShaderBinding& binding : gpu::shader_bindings(k_rays_storage_spirv))
        EXPECT_EQ(binding.type, kStorage);
}

TEST(ShaderInterface, StaysWithinTheBuffersThatItsDevicesHave) {
    for (const Kernel& kernel : kKernels) {
        const std::vector<gpu::ShaderBinding> bindings = gpu::shader_bindings(kernel.words);
        EXPECT_FALSE(bindings.empty()) << kernel.name;
        const bool has_texels = std::ranges::any_of(
            bindings, [](const auto& binding) { return binding.type != kStorage; });
        for (const VkDescriptorType type : {kStorageTexels, kStorage})
            EXPECT_LE(std::ranges::count(bindings, type, &gpu::ShaderBinding::type),
                      has_texels ? 4 : gpu::kMostStorageBuffers)
                << kernel.name;
        for (const gpu::ShaderBinding& binding : bindings)
            EXPECT_LT(binding.number, kBindingCount) << kernel.name;
    }
}

TEST(ShaderInterface, RefusesOtherResources) {
    // A float, a pointer to it in a uniform buffer, and a variable of that type.
    const std::uint32_t words[] = {0x07230203,    0, 0,  9, 0,  //
                                   3u << 16 | 22, 1, 32,        //
                                   4u << 16 | 32, 2, 2,  1,     //
                                   4u << 16 | 59, 2, 3,  2};
    EXPECT_THROW(gpu::shader_bindings(words), Error);
}

// ---- Layouts of shared structs

Offsets in_kernel(const char* type) { return member_offsets(k_layout_spirv, type); }

#define OFFSET(type, member) \
    { #member, static_cast < std::uint32_t>(offsetof(type, member)) }

TEST(SharedLayout, NodesAndLeavesAgree) {
    EXPECT_EQ(in_kernel("Node"), (Offsets{OFFSET(Node, planes), OFFSET(Node, child)}));
    EXPECT_EQ(in_kernel("Leaf"), (Offsets{OFFSET(Leaf, vertex), OFFSET(Leaf, prim_id)}));
    EXPECT_EQ(in_kernel("LeafVertex"),
              (Offsets{OFFSET(LeafVertex, x), OFFSET(LeafVertex, y), OFFSET(LeafVertex, z),
                       OFFSET(LeafVertex, corners)}));
}

TEST(SharedLayout, RaysAndHitsAgree) {
    EXPECT_EQ(in_kernel("Ray"),
              (Offsets{OFFSET(Ray, org), OFFSET(Ray, tnear), OFFSET(Ray, dir), OFFSET(Ray, tfar)}));
    EXPECT_EQ(in_kernel("Hit"),
              (Offsets{OFFSET(Hit, t), OFFSET(Hit, u), OFFSET(Hit, v), OFFSET(Hit, prim_id)}));
    EXPECT_EQ(in_kernel("Suspended"),
              (Offsets{OFFSET(Suspended, ray), OFFSET(Suspended, answer_index),
                       OFFSET(Suspended, open)}));
    EXPECT_EQ(in_kernel("WorkHeader"),
              (Offsets{OFFSET(WorkHeader, suspended_count), OFFSET(WorkHeader, unfinished_count),
                       OFFSET(WorkHeader, open_count), OFFSET(WorkHeader, visible_count),
                       OFFSET(WorkHeader, shown_count), OFFSET(WorkHeader, pad1),
                       OFFSET(WorkHeader, pad2), OFFSET(WorkHeader, pad3)}));
}

TEST(SharedLayout, ArgumentsAgree) {
    EXPECT_EQ(in_kernel("Camera"),
              (Offsets{OFFSET(Camera, org), OFFSET(Camera, pad0), OFFSET(Camera, corner),
                       OFFSET(Camera, pad1), OFFSET(Camera, du), OFFSET(Camera, pad2),
                       OFFSET(Camera, dv), OFFSET(Camera, pad3)}));
    EXPECT_EQ(in_kernel("ImageParams"),
              (Offsets{OFFSET(ImageParams, camera), OFFSET(ImageParams, light),
                       OFFSET(ImageParams, ao_tfar), OFFSET(ImageParams, width),
                       OFFSET(ImageParams, height), OFFSET(ImageParams, rays),
                       OFFSET(ImageParams, ao_count)}));
    EXPECT_EQ(in_kernel("RegionArguments"),
              (Offsets{OFFSET(RegionArguments, params), OFFSET(RegionArguments, x),
                       OFFSET(RegionArguments, y), OFFSET(RegionArguments, width),
                       OFFSET(RegionArguments, height), OFFSET(RegionArguments, tile_columns),
                       OFFSET(RegionArguments, tile_count), OFFSET(RegionArguments, tile_bits),
                       OFFSET(RegionArguments, first)}));
    EXPECT_EQ(in_kernel("LitArguments"), (Offsets{OFFSET(LitArguments, org),
                                                  OFFSET(LitArguments, kind),
                                                  OFFSET(LitArguments, corner),
                                                  OFFSET(LitArguments, side_bits),
                                                  OFFSET(LitArguments, du),
                                                  OFFSET(LitArguments, rays),
                                                  OFFSET(LitArguments, dv),
                                                  OFFSET(LitArguments, ao_count),
                                                  OFFSET(LitArguments, light),
                                                  OFFSET(LitArguments, near),
                                                  OFFSET(LitArguments, up),
                                                  OFFSET(LitArguments, per_depth),
                                                  OFFSET(LitArguments, image_height),
                                                  OFFSET(LitArguments, flags),
                                                  OFFSET(LitArguments, x),
                                                  OFFSET(LitArguments, y),
                                                  OFFSET(LitArguments, width),
                                                  OFFSET(LitArguments, height),
                                                  OFFSET(LitArguments, columns),
                                                  OFFSET(LitArguments, rows)}));
    EXPECT_EQ(
        in_kernel("OcclusionArguments"),
        (Offsets{OFFSET(OcclusionArguments, params), OFFSET(OcclusionArguments, x),
                 OFFSET(OcclusionArguments, y), OFFSET(OcclusionArguments, width),
                 OFFSET(OcclusionArguments, ray_first), OFFSET(OcclusionArguments, ray_end)}));
    EXPECT_EQ(in_kernel("CountArguments"), (Offsets{OFFSET(CountArguments, count)}));
    EXPECT_EQ(in_kernel("ResumeArguments"),
              (Offsets{OFFSET(ResumeArguments, first), OFFSET(ResumeArguments, count),
                       OFFSET(ResumeArguments, fresh), OFFSET(ResumeArguments, any_hit)}));
    EXPECT_EQ(in_kernel("RefitArguments"),
              (Offsets{OFFSET(RefitArguments, first), OFFSET(RefitArguments, count)}));
}

}  // namespace
}  // namespace mray::test
