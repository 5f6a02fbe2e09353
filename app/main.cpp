#include "app/commands/commands.h"
#include "app/process.h"

int main(int argc, char** argv) { mray::app::run_process(argc, argv, mray::app::run_command); }
