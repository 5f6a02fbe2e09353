#include "app/commands/commands.h"
#include "app/program.h"

namespace mray::app {
namespace {

template <class... Functions>
struct Overloaded : Functions... {
    using Functions::operator()...;
};
// clang 14 does not deduce the arguments of aggregates.
template <class... Functions>
Overloaded(Functions...) -> Overloaded<Functions...>;

ExitCode run_command(const CommandOptions& options, const Messages& messages) {
    return std::visit(Overloaded{
                          [&](const RenderOptions& o) { return run_render(o, messages); },
                          [&](const ViewOptions& o) { return run_view(o, messages); },
                          [&](const CrosscheckOptions& o) { return run_crosscheck(o, messages); },
                          [&](const DiffOptions& o) { return run_diff(o, messages); },
                          [&](const ProbeOptions& o) { return run_probe(o, messages); },
                          [&](const ProfileOptions& o) { return run_profile(o, messages); },
                          [&](const TraceOptions& o) { return run_trace(o, messages); },
                          [&](const QueryOptions& o) { return run_query(o, messages); },
                          [&](const ChartOptions& o) { return run_chart(o, messages); },
                          [&](const InfoOptions& o) { return run_info(o, messages); },
                          [&](const DevicesOptions& o) { return run_devices(o, messages); },
                      },
                      options);
}

}  // namespace
}  // namespace mray::app

int main(int argc, char** argv) { mray::app::run_process(argc, argv, mray::app::run_command); }
