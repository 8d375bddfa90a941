// The sub-commands, one file each. Each adds itself to the application; its callback does the work,
// prints results to stdout and throws InputError (exit 2) or anything else (exit 1). Those that run
// on several ranks take the communicator.
#pragma once

#include <CLI/CLI.hpp>

#include "agail/comm/communicator.h"

namespace agail {

// Thrown when a signal ended the work after everything was saved. Exit code 128 + signal.
struct Interrupted {
  int signal;
};

void add_envs(CLI::App& app);
void add_train(CLI::App& app, Communicator& communicator);
void add_record(CLI::App& app);
void add_mask(CLI::App& app);
void add_inspect(CLI::App& app);
void add_eval(CLI::App& app);
void add_bench(CLI::App& app, Communicator& communicator);
void add_convert(CLI::App& app);
void add_reproduce(CLI::App& app);

}  // namespace agail
