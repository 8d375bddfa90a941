#include "command_line.h"

#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <memory>
#include <string_view>

#include "agail/base/build_info.h"
#include "agail/base/error.h"
#include "agail/base/nearest.h"
#include "agail/comm/launch.h"
#include "agail/comm/together.h"
#include "commands.h"

namespace {

// An unknown sub-command x is the program agail-x, as git and cargo have it. Returns only if there
// is none.
void run_extension(int argc, char** argv) {
  std::vector<char*> arguments(argv + 1, argv + argc);
  std::string program = std::string("agail-") + argv[1];
  arguments[0] = program.data();
  arguments.push_back(nullptr);
  execvp(program.c_str(), arguments.data());
}

int run(int argc, char** argv, agail::Communicator& communicator) {
  CLI::App app{"Policies from demonstrations in which part of the actions is missing."};
  app.set_version_flag("--version", std::string("agail ") + agail::kVersion);
  app.require_subcommand(1);
  agail::add_envs(app);
  agail::add_train(app, communicator);
  agail::add_record(app);
  agail::add_mask(app);
  agail::add_convert(app);
  agail::add_inspect(app);
  agail::add_eval(app);
  agail::add_bench(app, communicator);
  agail::add_reproduce(app);

  if (argc > 1 && argv[1][0] != '-') {
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
    if (std::find(names.begin(), names.end(), argv[1]) == names.end()) {
      run_extension(argc, argv);
      const std::string name = argv[1];
      std::string advice = "did you mean '" + agail::nearest(name, names) + "'?";
      if (name == "export" || name == "report" || name == "video")
        advice = "it comes with agail's Python package: pip install . in the source folder";
      throw agail::InputError("no command 'agail " + name + "', and no program agail-" + name +
                              " on the PATH; " + advice);
    }
  }
  if (communicator.ranks() > 1) {
    if (communicator.rank() != 0 && std::freopen("/dev/null", "w", stdout) == nullptr)
      throw agail::SystemError("cannot open /dev/null");  // rank 0 alone prints results
    const std::string name = argc > 1 ? argv[1] : "";
    if (!name.starts_with('-') && name != "train" && name != "bench")
      throw agail::InputError("agail " + name +
                              " runs in one process; start it without a launcher");
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);  // --help, --version
    throw agail::InputError(std::string(e.what()) + "; see agail --help");
  }
  return 0;
}

// Failures of a single process as those of all.
int run_and_flush(int argc, char** argv, agail::Communicator& communicator) {
  int code = 0;
  try {
    code = run(argc, argv, communicator);
    agail::or_abort(communicator, [] {
      std::cout.flush();
      if (!std::cout) throw agail::SystemError("cannot write to standard output");
    });
  } catch (const std::exception&) {
    if (communicator.ranks() == 1) throw agail::current_failure();
    agail::together(communicator, [] { throw; });
  }
  return code;
}

}  // namespace

int agail::command_line(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // a write beyond `ulimit -f` fails, as on a full disk
  std::unique_ptr<agail::Communicator> communicator;
  try {
    // The processes of `reproduce` share work through files; a launcher may start them, too.
    const bool alone = argc > 1 && std::string_view(argv[1]) == "reproduce";
    if (alone)
      communicator = std::make_unique<agail::SerialCommunicator>();
    else
      communicator = agail::join_ranks();
  } catch (const agail::InputError& e) {
    if (agail::is_first_rank())
      std::fprintf(stderr, "agail: %s\n", agail::one_line(e.what()).c_str());
    return 2;
  }
  try {
    // Whatever goes wrong here went wrong on every rank, or the others learn of it.
    return run_and_flush(argc, argv, *communicator);
  } catch (const agail::Interrupted& e) {
    return 128 + e.signal;
  } catch (const agail::JobFailure& e) {
    if (communicator->rank() == 0) std::fprintf(stderr, "agail: %s\n", e.message.c_str());
    return e.exit_code;
  }
}
