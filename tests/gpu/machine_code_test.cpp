// AMD's machine code of every kernel rounds as the CPU does. Mesa's compiler makes it without a
// card.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <regex>

#include "gpu/limits.h"
#include "gpu/vulkan/pipeline.h"
#include "shaders/morphray_kernels.h"

namespace mray::test {
namespace {

/// Whether the reciprocal at this place serves a division of integers alone: scaled by nearly 2^32
/// in its own register it becomes an integer, which the division corrects.
bool divides_integers(const std::string& code, std::size_t at) {
    static const std::regex kDivision(
        R"(\tv_rcp(?:_iflag)?_f32\S* (v\d+), .*\n(?:(?!.*\b\1\b).*\n)*)"
        R"(\tv_mul_f32\S* \1, (0x4f7ffffe|s\d+), \1\b.*\n(?:(?!.*\b\1\b).*\n)*)"
        R"(\tv_cvt_u32_f32\S* v\d+, \1\b)");
    std::smatch parts;
    // All of the code would overflow the stack of this search.
    const std::string next = code.substr(at, 1000);
    if (!std::regex_search(next, parts, kDivision, std::regex_constants::match_continuous))
        return false;
    if (parts[2] == "0x4f7ffffe") return true;
    const std::string move = "s_mov_b32 " + parts[2].str() + ", ";
    const std::size_t set = code.rfind(move, at);
    return set != code.npos && code.substr(set + move.size(), 10) == "0x4f7ffffe";
}

/// The instructions that may treat floats in another way than the CPU, or cannot be read. Lines are
/// "<tab>name operand, operand modifiers ; bytes", or labels.
std::vector<std::string> objections(const std::string& assembly) {
    // v_mad_f32 and its kin round the product, and processors that only fuse lack them. A fused
    // product with a power of two is exact.
    static const std::regex kExact(
        R"(\t(?!.* (clamp|mul:|div:))v_()"
        R"((add|sub|subrev|mul|mad|mac|madak|madmk|min3?|max3?|cmpx?_n?(eq|lg|lt|le|gt|ge))_f32|)"
        R"(cvt_(u32_f32|f32_u32|f32_ubyte[0-3])|)"
        R"(fma(c|ak|mk)?_f32(_e32|_e64)? \S+, (\S+, )?)"
        R"(-?(0\.5|[124]\.0|0x(?![7f]f8)[0-9a-f]{1,2}[08]00000)[, ]).*)");
    static const std::regex kAsked(
        R"(\t\((?!then repeated).*|[^;]*(f16|f32|f64|(round|denorm)_mode|HW_REG_MODE).*)");
    std::vector<std::string> found;
    std::size_t end = 0;
    for (std::size_t at = 0; at < assembly.size(); at = end + 1) {
        end = std::min(assembly.find('\n', at), assembly.size());
        const std::string line = assembly.substr(at, end - at);
        if (std::regex_match(line, kAsked) && !std::regex_match(line, kExact) &&
            !divides_integers(assembly, at))
            found.push_back(line);
    }
    return found;
}

PFN_vkCreateDevice create_device = nullptr;
PFN_vkCreateComputePipelines create_pipelines = nullptr;

/// Lets devices and pipelines that are made from now on tell their machine code.
void ask_for_assembly() {
    create_device = std::exchange(vkCreateDevice, [](auto physical, auto* info, auto*, auto* made) {
        const VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR tells = {
            .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PIPELINE_EXECUTABLE_PROPERTIES_FEATURES_KHR,
            .pipelineExecutableInfo = VK_TRUE};
        const char* const extension = VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME;
        VkDeviceCreateInfo telling = *info;
        telling.pNext = &tells;
        telling.enabledExtensionCount = 1;
        telling.ppEnabledExtensionNames = &extension;
        return create_device(physical, &telling, nullptr, made);
    });
    create_pipelines = std::exchange(
        vkCreateComputePipelines, [](auto device, auto, auto, auto* info, auto*, auto* made) {
            VkComputePipelineCreateInfo telling = *info;
            telling.flags = VK_PIPELINE_CREATE_CAPTURE_INTERNAL_REPRESENTATIONS_BIT_KHR;
            return create_pipelines(device, VK_NULL_HANDLE, 1, &telling, nullptr, made);
        });
}

std::string assembly_of(VkDevice device, VkPipeline pipeline) {
    const VkPipelineExecutableInfoKHR info = {
        .sType = VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_INFO_KHR, .pipeline = pipeline};
    std::array<VkPipelineExecutableInternalRepresentationKHR, 8> all = {};
    for (auto& one : all)
        one.sType = VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_INTERNAL_REPRESENTATION_KHR;
    std::uint32_t count = all.size();
    const auto read = vkGetPipelineExecutableInternalRepresentationsKHR;
    gpu::check(read(device, &info, &count, all.data()), "read the size of machine code");
    const auto code =
        std::ranges::find_if(all, [](auto& i) { return std::string("Assembly") == i.name; });
    if (code == all.end()) throw Error(ErrorKind::kUnavailable, "no assembly");
    std::string text(code->dataSize, '\0');
    code->pData = text.data();
    gpu::check(read(device, &info, &count, all.data()), "read machine code");
    if (text.find("s_endpgm") == text.npos) throw Error(ErrorKind::kUnavailable, "no disassembler");
    return text;
}

using Words = std::vector<std::uint32_t>;
using Kernels = std::vector<std::pair<std::string, Words>>;
enum Answer { kClean, kWrong, kRefused };

/// Compiles kernels for a family of processors and prints objections.
Answer judge(const char* family, const Kernels& kernels) {
    for (const char* const name : {"VK_DRIVER_FILES", "VK_ICD_FILENAMES"})
        setenv(name, "/usr/share/vulkan/icd.d/radeon_icd.x86_64.json", 1);
    setenv("RADV_FORCE_FAMILY", family, 1);
    Answer answer = kRefused;
    try {
        const auto instance = std::make_shared<gpu::Instance>(false, nullptr);
        ask_for_assembly();
        gpu::Device device(instance, gpu::physical_devices(*instance).at(0), false);
        const std::array steps = {gpu::step_budget(device.physical(), {})};
        for (const auto& [name, words] : kernels) {
            const gpu::Pipeline pipeline(device, words, steps);
            const auto found = objections(assembly_of(device.get(), pipeline.get()));
            for (const std::string& text : found) fmt::print("{}: {}\n", name, text);
            answer = !found.empty() || answer == kWrong ? kWrong : kClean;
        }
    } catch (const Error& error) {
        fmt::print("{}\n", error.what());
        if (answer == kClean) answer = kWrong;
    }
    return answer;
}

/// judge() in a child process: drivers read the environment, and abort for unknown families.
Answer answer_of(const char* family, const Kernels& kernels) {
    std::fflush(nullptr);
    const ::pid_t child = ::fork();
    if (child == 0) {
        const Answer answer = judge(family, kernels);
        std::fflush(nullptr);
        ::_exit(answer);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    if (WIFEXITED(status)) return static_cast<Answer>(WEXITSTATUS(status));
    return WTERMSIG(status) == SIGABRT ? kRefused : kWrong;
}

class MachineCode : public testing::TestWithParam<std::tuple<const char*, bool>> {};

TEST_P(MachineCode, RoundsAsTheCpuDoes) {
    const char* const family = std::get<0>(GetParam());
    const bool is_storage = std::get<1>(GetParam());
#define KERNEL(name) {#name, Words(std::begin(k_##name##_spirv), std::end(k_##name##_spirv))},
    Kernels kernels = {MORPHRAY_KERNELS(KERNEL)};
    std::erase_if(kernels, [&](auto& k) { return k.first.ends_with("_storage") != is_storage; });
    Answer answer = answer_of(family, kernels);
    // Mesa's name of gfx1100 since 23.1.
    if (answer == kRefused && family == std::string("gfx1100"))
        answer = answer_of("navi31", kernels);
    if (answer == kRefused) GTEST_SKIP() << "no RADV with null hardware";
    EXPECT_EQ(answer, kClean);
}

INSTANTIATE_TEST_SUITE_P(Amd, MachineCode,
                         testing::Combine(testing::Values("polaris10", "vega10", "navi10", "navi21",
                                                          "gfx1100"),
                                          testing::Bool()));

TEST(MachineCodeCheck, FindsAKernelWithoutPrecise) {
    constexpr std::uint32_t kDecorate = 71, kNoContraction = 42, kRelaxedPrecision = 0;
    Words words(std::begin(k_winding_spirv), std::end(k_winding_spirv));
    for (const gpu::SpirvInstruction& i : gpu::read_spirv(k_winding_spirv))
        if (i.opcode == kDecorate && i.operands[1] == kNoContraction)
            words[&i.operands[1] - k_winding_spirv] = kRelaxedPrecision;
    // Older processors fuse nothing.
    const Answer answer = answer_of("navi21", {{"without precise", words}});
    if (answer == kRefused) GTEST_SKIP() << "no RADV with null hardware";
    EXPECT_EQ(answer, kWrong);
}

TEST(MachineCodeCheck, TellsExactInstructionsFromOthers) {
    const std::string exact =
        "\tv_mul_f32_e64 v1, |v2|, -s3 ; 0\n\tv_cmp_nlt_f32_e32 vcc, v1, v2 ; 0\n"
        "\tv_fmaak_f32 v1, 2.0, v2, 0x35000001 ; 0\n\tv_fma_f32 v1, v2, 0xbe000000, v3 ; 0\n"
        "\tv_rcp_f32_e32 v1, v1 ; 0\n\tv_mul_f32_e32 v1, 0x4f7ffffe, v1 ; 0\n"
        "\tv_cvt_u32_f32_e32 v2, v1 ; 0\n\ts_endpgm ; 0\n";
    EXPECT_EQ(objections(exact), std::vector<std::string>());
    for (const char* const wrong :
         {"\tv_fma_f32 v1, v2, v3, 2.0", "\tv_fmac_f32_e32 v1, 0x40400000, v2",
          "\tv_rcp_f32_e32 v1, v2", "\tv_sqrt_f32_e32 v1, v2", "\tv_mul_f32_e64 v1, v2, v3 clamp",
          "\tv_add_f16 v1, v2, v3", "\ts_round_mode 0x3", "\t(invalid instruction)"})
        EXPECT_EQ(objections(wrong + (" ; 0\n" + exact)), std::vector{std::string(wrong) + " ; 0"});
}

}  // namespace
}  // namespace mray::test
