#include "common/process/gnuplot.h"

#include "common/process/shell_command.h"

namespace mray {

bool has_gnuplot() { return run_shell("command -v gnuplot").status == 0; }

std::string gnuplot_quoted(std::string_view text) {
    std::string result = "'";
    for (const char c : text) {
        if (c == '\n' || c == '\r') continue;
        result.append(c == '\'' ? 2 : 1, c);
    }
    return result + "'";
}

}  // namespace mray
