#include "app/conflicts.h"

#include <fmt/format.h>

#include "app/messages.h"
#include "common/error.h"

namespace morphray::app {

void check_conflicts(const Options& options) {
    if (options.tree.update == "rebuild" && options.tree.refit_on != RefitOn::kOwn) {
        throw Error(ExitCode::kUsage,
                    "--update rebuild, --refit-on: a tree that is rebuilt is not refitted; leave "
                    "one of them out");
    }
    if (!is_stdout(options.json)) return;
    for (const auto& [name, file] :
         {std::pair("--junit", &options.junit), std::pair("--csv", &options.csv)}) {
        if (!is_stdout(*file)) continue;
        throw Error(ExitCode::kUsage,
                    fmt::format("--json, {}: both go to stdout, which takes one report; give one "
                                "of them a file",
                                name));
    }
}

}  // namespace morphray::app
