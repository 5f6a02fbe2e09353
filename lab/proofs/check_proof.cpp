// check_proof GAPPA FILE.g: whether Gappa proves every lemma of the file.
// check_proof GAPPA FILE.g NAME FACTOR: whether it no longer does once the constant NAME is FACTOR
// times as large. FACTOR is a number or a fraction such as 16/17.
//
// A file is comments (the table of inputs, operations and bound) and lemmas, each opened by a line
// "## lemma: what it says" and in Gappa's language, or by "## identity: what it says" and a list of
// definitions and of polynomials that are 0. @kName@ stands for a constant of
// lab/proofs/constants.h.
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "lab/proofs/constants.h"

namespace mray::proofs {
namespace {

using Values = std::map<std::string, double, std::less<>>;

std::string hexadecimal(double value) {
    char text[64];
    std::snprintf(text, sizeof text, "%a", value);
    return text;
}

double factor_of(const std::string& text) {
    const std::size_t slash = text.find('/');
    if (slash == std::string::npos) return std::stod(text);
    return std::stod(text.substr(0, slash)) / std::stod(text.substr(slash + 1));
}

/// The line with the values of its @kNames@. Gappa's own uses of the sign (@FIX, @rnd) stay.
std::string substituted(std::string line, const Values& values) {
    std::size_t at = line.find("@k");
    while (at != std::string::npos) {
        const std::size_t end = line.find('@', at + 1);
        if (end == std::string::npos) throw std::runtime_error("no second @ in: " + line);
        const auto value = values.find(line.substr(at + 1, end - at - 1));
        if (value == values.end()) throw std::runtime_error("no such constant in: " + line);
        line.replace(at, end - at + 1, hexadecimal(value->second));
        at = line.find("@k");
    }
    return line;
}

struct Lemma {
    std::string title;
    std::string text;
};

/// The lemma that each polynomial of an identity is 0, with that as its rewriting rule, which Gappa
/// checks by algebra.
std::string lemma_of_identity(const std::string& text) {
    std::istringstream in(text);
    std::string definitions, goals, rules;
    for (std::string one; std::getline(in, one, ';');) {
        if (one.find_first_not_of(" \n") == std::string::npos) continue;
        if (one.find('=') != std::string::npos) {
            definitions += one + ";\n";
            continue;
        }
        goals += (goals.empty() ? "{" : "/\\") + one + " in [0, 0]\n";
        rules += one + " -> 0;\n";
    }
    return definitions + goals + "}\n" + rules;
}

std::vector<Lemma> read_lemmas(const std::string& path, const Values& values) {
    std::ifstream in(path);
    if (!in) throw std::runtime_error("cannot read " + path);
    const std::string identity = "## identity: ";
    std::vector<Lemma> lemmas;
    bool is_identity = false;
    const auto close = [&] {
        if (is_identity) lemmas.back().text = lemma_of_identity(lemmas.back().text);
    };
    std::string line;
    while (std::getline(in, line)) {
        if (line.starts_with("## lemma: ") || line.starts_with(identity)) {
            close();
            is_identity = line.starts_with(identity);
            lemmas.push_back({line.substr(line.find(": ") + 2), ""});
        } else if (!lemmas.empty()) {
            lemmas.back().text += substituted(line.substr(0, line.find('#')), values) + "\n";
        }
    }
    close();
    if (lemmas.empty()) throw std::runtime_error(path + " has no line \"## lemma: ...\"");
    return lemmas;
}

enum class Verdict { proved, not_proved };

/// Asks Gappa. Its warnings count as errors: one of them tells that a rewriting rule is wrong.
Verdict ask(const std::string& gappa, const Lemma& lemma, const std::string& scratch) {
    std::ofstream(scratch) << lemma.text;
    std::FILE* pipe = ::popen(("timeout 30 " + gappa + " " + scratch + " 2>&1").c_str(), "r");
    if (pipe == nullptr) throw std::runtime_error("cannot start " + gappa);
    std::string said;
    char piece[512];
    while (std::fgets(piece, sizeof piece, pipe) != nullptr) said += piece;
    const int status = ::pclose(pipe);
    if (!WIFEXITED(status)) throw std::runtime_error(gappa + " was killed");
    if (said.find("Warning") != std::string::npos || said.find("syntax") != std::string::npos)
        throw std::runtime_error(lemma.title + ":\n" + said);
    if (WEXITSTATUS(status) == 0) return Verdict::proved;
    // The second is what a false inequality between constants gives.
    if (said.find("some properties were not satisfied") == std::string::npos &&
        said.find("no contradiction was found") == std::string::npos)
        throw std::runtime_error(lemma.title + ":\n" + said);
    std::cout << "not proved: " << lemma.title << '\n' << said;
    return Verdict::not_proved;
}

int run(const std::vector<std::string>& arguments) {
    if (arguments.size() != 2 && arguments.size() != 4)
        throw std::runtime_error("usage: check_proof GAPPA FILE.g [NAME FACTOR]");
    Values values;
    for (const Constant& constant : kConstants)
        values.emplace(std::string(constant.name), constant.value);
    const bool is_changed = arguments.size() == 4;
    if (is_changed) {
        const auto value = values.find(arguments[2]);
        if (value == values.end()) throw std::runtime_error("no constant named " + arguments[2]);
        value->second *= factor_of(arguments[3]);
    }
    const std::filesystem::path folder = std::filesystem::temp_directory_path();
    std::string scratch = folder / "proof_XXXXXX";
    const int file = ::mkstemp(scratch.data());
    if (file < 0) throw std::runtime_error("cannot make a file in " + folder.string());
    ::close(file);
    std::size_t proved = 0;
    const std::vector<Lemma> lemmas = read_lemmas(arguments[1], values);
    for (const Lemma& lemma : lemmas)
        proved += ask(arguments[0], lemma, scratch) == Verdict::proved;
    std::remove(scratch.c_str());
    std::cout << proved << " of " << lemmas.size() << " lemmas proved\n";
    return (proved == lemmas.size()) == is_changed ? 1 : 0;
}

}  // namespace
}  // namespace mray::proofs

int main(int argc, char** argv) {
    try {
        return mray::proofs::run({argv + 1, argv + argc});
    } catch (const std::exception& error) {
        std::cerr << "check_proof: " << error.what() << '\n';
        return 2;
    }
}
