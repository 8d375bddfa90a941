// agail: the command line. Exit codes: 0 done; 1 our or the machine's failure; 2 the user's input;
// 128 + signal.
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iostream>

#include "agail/base/build_info.h"
#include "agail/base/error.h"
#include "agail/base/nearest.h"
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

int run(int argc, char** argv) {
  CLI::App app{"Policies from demonstrations in which part of the actions is missing."};
  app.set_version_flag("--version", std::string("agail ") + agail::kVersion);
  app.require_subcommand(1);
  agail::add_envs(app);
  agail::add_train(app);
  agail::add_record(app);
  agail::add_mask(app);
  agail::add_convert(app);
  agail::add_inspect(app);
  agail::add_eval(app);
  agail::add_bench(app);

  if (argc > 1 && argv[1][0] != '-') {
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
    if (std::find(names.begin(), names.end(), argv[1]) == names.end()) {
      run_extension(argc, argv);
      const std::string name = argv[1];
      std::string advice = "did you mean '" + agail::nearest(name, names) + "'?";
      if (name == "report" || name == "video") advice = "it comes with the Python package of agail";
      throw agail::InputError("no command 'agail " + name + "', and no program agail-" + name +
                              " on the PATH; " + advice);
    }
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);  // --help, --version
    throw agail::InputError(std::string(e.what()) + "; see agail --help");
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const int code = run(argc, argv);
    std::cout.flush();
    if (!std::cout) throw agail::SystemError("cannot write to standard output");
    return code;
  } catch (const agail::Interrupted& e) {
    return 128 + e.signal;
  } catch (const agail::InputError& e) {
    std::fprintf(stderr, "agail: %s\n", e.what());
    return 2;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "agail: %s\n", e.what());
    return 1;
  }
}
