#include "tests/app/program.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <iterator>
#include <regex>
#include <sstream>
#include <utility>

namespace mray::test {
namespace {

using Clock = std::chrono::steady_clock;

// Far above what any run takes, with sanitizers on a busy machine, too.
constexpr auto kTimeLimit = std::chrono::seconds(300);

void redirect(int from, int to) {
    if (from < 0 || ::dup2(from, to) < 0) ::_exit(99);
}

void apply(const Surroundings& s) {
    for (const std::string& variable : s.environment) {
        const std::size_t equals = variable.find('=');
        if (equals == std::string::npos) {
            ::unsetenv(variable.c_str());
        } else {
            ::setenv(variable.substr(0, equals).c_str(), variable.c_str() + equals + 1, 1);
        }
    }
    if (!s.folder.empty() && ::chdir(s.folder.c_str()) != 0) ::_exit(99);
    if (!s.stdout_to.empty()) redirect(::open(s.stdout_to.c_str(), O_WRONLY), STDOUT_FILENO);
    if (s.stdout_closed) ::close(STDOUT_FILENO);
}

int input_of(const std::string& text) {
    std::FILE* const file = std::tmpfile();
    std::fwrite(text.data(), 1, text.size(), file);
    std::rewind(file);
    return ::fileno(file);
}

[[noreturn]] void become_program(const Words& arguments, const Surroundings& surroundings) {
    apply(surroundings);
    std::vector<char*> argv;
    std::string program = MORPHRAY_PROGRAM;
    argv.push_back(program.data());
    for (const std::string& argument : arguments) {
        argv.push_back(const_cast<char*>(argument.c_str()));
    }
    argv.push_back(nullptr);
    ::execv(argv[0], argv.data());
    ::_exit(99);
}

// Reads both pipes at the same time, because a full one would block the program.
void drain(std::array<int, 2> fds, std::array<std::string*, 2> texts, pid_t pid) {
    const auto deadline = Clock::now() + kTimeLimit;
    std::array<pollfd, 2> polled = {{{fds[0], POLLIN, 0}, {fds[1], POLLIN, 0}}};
    while (polled[0].fd >= 0 || polled[1].fd >= 0) {
        if (Clock::now() > deadline) {
            ADD_FAILURE() << "killed after " << kTimeLimit.count() << " s";
            ::kill(pid, SIGKILL);
        }
        ::poll(polled.data(), polled.size(), 100);
        for (std::size_t i = 0; i < 2; ++i) {
            if (polled[i].fd < 0 || polled[i].revents == 0) continue;
            std::array<char, 4096> buffer;
            const ssize_t got = ::read(polled[i].fd, buffer.data(), buffer.size());
            if (got > 0) texts[i]->append(buffer.data(), static_cast<std::size_t>(got));
            if (got <= 0) polled[i].fd = -1;
        }
    }
}

/// Makes ends[0] what a terminal shows, and ends[1] the terminal.
bool open_terminal(int (&ends)[2]) {
    ends[0] = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (ends[0] < 0 || ::grantpt(ends[0]) != 0 || ::unlockpt(ends[0]) != 0) return false;
    ends[1] = ::open(::ptsname(ends[0]), O_RDWR | O_NOCTTY | O_CLOEXEC);
    winsize size = {};
    size.ws_col = 100;
    return ends[1] >= 0 && ::ioctl(ends[1], TIOCSWINSZ, &size) == 0;
}

}  // namespace

Started::Started(const Words& arguments, const Surroundings& surroundings) {
    int out[2];
    int err[2];
    if (::pipe2(out, O_CLOEXEC) != 0) std::abort();
    if (surroundings.on_terminal ? !open_terminal(err) : ::pipe2(err, O_CLOEXEC) != 0) std::abort();
    const int input = input_of(surroundings.input);
    pid_ = ::fork();
    if (pid_ == 0) {
        redirect(input, STDIN_FILENO);
        redirect(out[1], STDOUT_FILENO);
        redirect(err[1], STDERR_FILENO);
        become_program(arguments, surroundings);
    }
    ::close(input);
    ::close(out[1]);
    ::close(err[1]);
    out_ = out[0];
    err_ = err[0];
}

Started::~Started() {
    if (pid_ > 0) {
        ::kill(pid_, SIGKILL);
        ::waitpid(pid_, nullptr, 0);
    }
    ::close(out_);
    ::close(err_);
}

std::string Started::wait_for(int fd, std::string& text, const std::string& pattern) {
    const std::regex wanted(pattern);
    const auto deadline = Clock::now() + kTimeLimit;
    for (;;) {
        std::smatch found;
        if (std::regex_search(text, found, wanted)) return found.str();
        std::array<char, 4096> buffer;
        pollfd polled = {fd, POLLIN, 0};
        ::poll(&polled, 1, 100);
        const bool is_ready = polled.revents != 0;
        const ssize_t got = is_ready ? ::read(fd, buffer.data(), buffer.size()) : 0;
        if (got > 0) text.append(buffer.data(), static_cast<std::size_t>(got));
        if (Clock::now() > deadline || (is_ready && got <= 0)) {
            ADD_FAILURE() << "no " << pattern << " in:\n" << text;
            return {};
        }
    }
}

void Started::send(int signal) { ::kill(pid_, signal); }

Outcome Started::wait() {
    Outcome outcome = std::move(outcome_);
    drain({out_, err_}, {&outcome.out, &outcome.err}, pid_);
    int status = 0;
    ::waitpid(std::exchange(pid_, -1), &status, 0);
    outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return outcome;
}

Words words(const std::string& line, const Words& more) {
    std::istringstream in(line);
    Words all{std::istream_iterator<std::string>(in), {}};
    all.insert(all.end(), more.begin(), more.end());
    return all;
}

Outcome run(const Words& arguments, const Surroundings& surroundings) {
    return Started(arguments, surroundings).wait();
}

nlohmann::json json_of(const Outcome& outcome) {
    EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
    return nlohmann::json::parse(outcome.out);
}

Words lines(const std::string& text) {
    std::istringstream in(text);
    Words result;
    for (std::string line; std::getline(in, line);) result.push_back(line);
    return result;
}

Words source_of(const std::filesystem::path& png) {
    const std::string bytes = read_file(png);
    const std::string chunk("iTXtSource\0\0\0\0\0morphray ", 24);
    const std::size_t at = bytes.find(chunk);
    EXPECT_NE(at, std::string::npos) << png;
    if (at == std::string::npos) return {};
    std::size_t size = 0;
    for (std::size_t i = at - 4; i < at; ++i)
        size = size << 8 | static_cast<unsigned char>(bytes[i]);
    return words(bytes.substr(at + chunk.size(), size + 4 - chunk.size()));
}

}  // namespace mray::test
