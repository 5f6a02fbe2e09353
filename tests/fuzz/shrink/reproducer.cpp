#include "tests/fuzz/shrink/reproducer.h"

#include <fmt/format.h>

#include <cstdlib>
#include <sstream>

#include "app/base/options.h"
#include "common/base/output_file.h"
#include "tests/fuzz/case/case_text.h"
#include "tools/process/shell_command.h"
#include "tools/process/shell_text.h"

namespace mray::fuzz {
namespace {

std::string comma_separated(const Point& p) { return fmt::format("{},{},{}", p[0], p[1], p[2]); }

std::vector<std::string> words_of(const std::string& text) {
    std::istringstream stream(text);
    std::vector<std::string> words;
    for (std::string word; stream >> word;) words.push_back(word);
    return words;
}

std::string rays_text(const FuzzCase& fuzz_case) {
    std::string text;
    for (const WorldRay& r : fuzz_case.rays)
        text += fmt::format("{} {} {} {} {} {} {} {}\n", r.org[0], r.org[1], r.org[2], r.dir[0],
                            r.dir[1], r.dir[2], r.tnear, r.tfar);
    return text;
}

std::string points_text(const FuzzCase& fuzz_case) {
    std::string text;
    for (const vec3& p : fuzz_case.points) text += fmt::format("{} {} {}\n", p.x, p.y, p.z);
    return text;
}

/// `morphray trace` of the case's rays, or `morphray query` of its points, to stdout.
std::string answer_line(const FuzzCase& fuzz_case, Asked asked, const std::string& program,
                        const std::string& folder, const std::string& backend) {
    const std::string place = shell_quoted(folder);
    if (is_about_points(asked)) {
        return fmt::format(
            "{} query {} --lenient --allow-empty --frames {} --points {}/points.txt "
            "--ask inside,winding,distance,closest --quiet {}",
            program, place, fuzz_case.frame, place, backend);
    }
    const std::string line =
        fmt::format("{} trace {} --frames {} --rays {}/rays.txt --out - --quiet {}", program, place,
                    fuzz_case.frame, place, backend);
    if (asked == Asked::kClosestHits || asked == Asked::kAnyHits) return line;
    return fmt::format("{} --all; {} --all --crossing each", line, line);
}

/// The environment variables that the device depends on.
std::string environment_of(const Variant& variant) {
    if (!variant.tracer.starts_with("vulkan")) return {};
    const char* const width = std::getenv("LP_NATIVE_VECTOR_WIDTH");
    return width == nullptr ? std::string() : fmt::format("LP_NATIVE_VECTOR_WIDTH={} ", width);
}

std::string line_with(const std::string& program, const FuzzCase& fuzz_case, const Finding& finding,
                      const std::string& folder) {
    const Variant& variant = *finding.variant;
    const std::string environment = environment_of(variant);
    if (!fuzz_case.has_image()) {
        const auto line = [&](const std::string& backend) {
            return answer_line(fuzz_case, finding.answer.asked, program, folder, backend);
        };
        return environment + fmt::format("bash -c 'cmp <({}) <({})'", line("--backend brute"),
                                         line(variant.arguments));
    }
    return environment + program + " " +
           shell_line(crosscheck_arguments(fuzz_case, variant, folder));
}

void write_files(const FuzzCase& fuzz_case, const std::filesystem::path& folder,
                 const std::string& remarks) {
    std::filesystem::remove_all(folder);
    make_output_folder(folder);
    for (std::size_t pose = 0; pose < fuzz_case.poses.size(); ++pose)
        write_file(folder / fmt::format("f{:04}.obj", pose), obj_text(fuzz_case, pose));
    if (!fuzz_case.rays.empty()) write_file(folder / "rays.txt", rays_text(fuzz_case));
    if (!fuzz_case.points.empty()) write_file(folder / "points.txt", points_text(fuzz_case));
    write_file(folder / "case.txt", to_text(fuzz_case, remarks));
}

}  // namespace

std::string obj_text(const FuzzCase& fuzz_case, std::size_t pose) {
    std::string text;
    for (const vec3& v : fuzz_case.poses[pose]) text += fmt::format("v {} {} {}\n", v.x, v.y, v.z);
    for (const uvec3& t : fuzz_case.triangles)
        text += fmt::format("f {} {} {}\n", t.x + 1, t.y + 1, t.z + 1);
    return text;
}

std::vector<std::string> crosscheck_arguments(const FuzzCase& fuzz_case, const Variant& variant,
                                              const std::string& folder) {
    const ViewSpec& view = fuzz_case.view;
    std::vector<std::string> line = {"crosscheck", folder, "--lenient", "--allow-empty"};
    const auto add = [&line](const char* name, const std::string& value) {
        line.insert(line.end(), {name, value});
    };
    add("--frames", fmt::format("{}", fuzz_case.frame));
    add("--build-at", fmt::format("{}", fuzz_case.build_at));
    add("--size", fmt::format("{}x{}", view.width, view.height));
    add("--fov", fmt::format("{}", view.fov));
    add("--up", comma_separated(view.up));
    if (view.eye) add("--eye", comma_separated(*view.eye));
    if (view.target) add("--target", comma_separated(*view.target));
    if (view.light && view.rays == kRaysShadow) add("--light", comma_separated(*view.light));
    add("--rays", app::name_of_rays(view.rays));
    if (view.rays == kRaysAo) {
        add("--ao-samples", fmt::format("{}", view.ao_count));
        add("--ao-distance", fmt::format("{}", view.ao_distance));
    }
    add("--reference", "brute");
    add("--out", folder + "/difference");
    for (const std::string& word : words_of(variant.arguments)) line.push_back(word);
    return line;
}

Reproducer write_reproducer(const FuzzCase& fuzz_case, const Finding& finding,
                            const std::filesystem::path& folder,
                            const std::filesystem::path& program, const std::string& remarks) {
    Reproducer reproducer;
    const Variant& variant = *finding.variant;
    if (!variant.arguments.empty())
        reproducer.line = line_with("morphray", fuzz_case, finding, folder.string());
    write_files(fuzz_case, folder, remarks);
    if (!reproducer.line.empty()) write_file(folder / "cmd.sh", reproducer.line + "\n");
    if (reproducer.line.empty()) {
        reproducer.remark = "the program has no such tracer; replay case.txt";
    } else if (!std::filesystem::exists(program)) {
        reproducer.remark = fmt::format("not tried: {} does not exist", program.string());
    } else {
        const ShellResult result = run_shell(
            line_with(shell_quoted(program.string()), fuzz_case, finding, folder.string()) +
            " >/dev/null 2>&1");
        reproducer.reproduces = result.status == 1;
        reproducer.remark =
            reproducer.reproduces
                ? "the program finds it, too"
                : fmt::format("does not reproduce through the program (it ends with {})",
                              result.status);
    }
    return reproducer;
}

}  // namespace mray::fuzz
