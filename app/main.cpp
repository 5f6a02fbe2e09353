#include <fcntl.h>
#include <unistd.h>

#include <string>
#include <vector>

#include "app/program.h"

namespace {

// With a closed stdin, stdout or stderr the next file that is opened would take its number and
// receive what is printed. Opened for the other direction, it keeps failing as a closed one does.
void hold_standard_descriptors() {
    for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        if (::fcntl(fd, F_GETFD) >= 0) continue;
        const int held = ::open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY);
        if (held < 0) return;
    }
}

}  // namespace

int main(int argc, char** argv) {
    hold_standard_descriptors();
    const std::vector<std::string> arguments(argv + (argc > 0 ? 1 : 0), argv + argc);
    return morphray::app::run_program(arguments);
}
