// The readers of files that others made, each as a function of bytes, and how it may end.
#pragma once

#include <exception>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

#include "common/base/errors.h"
#include "tests/fuzz/generate/dice.h"

namespace mray::fuzz {

/// Takes the bytes as a user would give them. Returns what is wrong with the outcome. Returns an
/// empty text if it is a value that keeps the promises of its type, or an error of the project
/// about the input (exit codes 3 and 6) in one line that names the file. Not thread-safe.
using FailureFunction = std::string (*)(std::string_view bytes);

/// An OBJ file; what follows a line `====` is the material library m.mtl beside it.
std::string obj_failure(std::string_view bytes);
std::string mtl_failure(std::string_view bytes);
std::string ply_failure(std::string_view bytes);
/// A .gltf file, or a .glb file if it begins like one.
std::string gltf_failure(std::string_view bytes);
/// Positions of a mesh of three vertices.
std::string pc2_failure(std::string_view bytes);
/// Images of `diff`, and textures.
std::string png_failure(std::string_view bytes);
std::string jpeg_failure(std::string_view bytes);

struct Target {
    /// The name of the folder with its corpus, too.
    std::string_view name;
    FailureFunction failure_of;
};
inline constexpr Target kTargets[] = {
    {"obj", obj_failure}, {"mtl", mtl_failure}, {"ply", ply_failure},  {"gltf", gltf_failure},
    {"pc2", pc2_failure}, {"png", png_failure}, {"jpeg", jpeg_failure}};

/// The bytes with one to four changes: cut, bits and bytes changed, numbers of 1 to 8 bytes set to
/// 0, 1, their limits or what lies beside those, decimal numbers replaced by such ones, parts
/// removed, doubled, moved or swapped, a very long line. The lengths in a GLB file follow its text,
/// mostly.
std::string mutated(std::string bytes, Dice& dice);

/// Returns what is wrong with a message: several lines, control characters, a text out of all
/// proportion, or one without `name` (which may be empty). Empty if nothing is.
std::string message_failure(std::string_view message, std::string_view name);

/// Returns what is wrong with an error about the file `name`.
std::string error_failure(const Error& error, std::string_view name);

/// Keeps what is wrong with the first bad warning.
class WarningJudge {
public:
    /// Must not outlive the judge.
    WarnFunction function() {
        return [this](const Warning& warning) {
            if (failure_.empty()) failure_ = message_failure(warning.line(), {});
        };
    }
    const std::string& failure() const { return failure_; }

private:
    std::string failure_;
};

/// Calls work(is_lenient), which returns what is wrong, and judges what it throws. What is refused
/// when it is read strictly is read leniently, too, if there is such a way.
template <class Work>
std::string failure_of(std::string_view name, Work work,
                       std::initializer_list<bool> ways = {false, true}) {
    for (const bool is_lenient : ways) {
        try {
            return work(is_lenient);
        } catch (const Error& error) {
            const std::string failure = error_failure(error, name);
            if (!failure.empty()) return failure;
        } catch (const std::exception& error) {
            return std::string("exception: ") + error.what();
        }
    }
    return {};
}

}  // namespace mray::fuzz
