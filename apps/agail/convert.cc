// agail convert: plain arrays to demonstrations.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>

#include "agail/base/error.h"
#include "agail/demos/csv_table.h"
#include "agail/demos/minari_writer.h"
#include "agail/demos/npz_table.h"
#include "agail/train/table_demonstrations.h"
#include "commands.h"
#include "inspect_demos.h"
#include "option_checks.h"

namespace agail {
namespace {

struct Options {
  std::string input;
  std::string output;
  std::string environment;
};

StepTable read_table(const std::string& path, std::vector<std::string>& ignored) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension != ".npz" && extension != ".csv")
    throw InputError(path + " is neither a .npz nor a .csv file; save the arrays as one of these");
  return extension == ".npz" ? read_npz(path, ignored) : read_csv(path, ignored);
}

// The columns or arrays of other names, which may be many.
void tell_ignored(const std::string& path, const std::vector<std::string>& names) {
  if (names.empty()) return;
  const std::size_t shown = std::min<std::size_t>(names.size(), 10);
  std::string note = "agail: note: ignored in " + path + ": " + names[0];
  for (std::size_t i = 1; i < shown; ++i) note += ", " + names[i];
  if (shown < names.size()) note += " and " + std::to_string(names.size() - shown) + " more";
  std::cerr << one_line(note) << "\n";
}

void run(const Options& options) {
  if (options.environment.empty())
    throw InputError("--env is empty; give the environment's Gymnasium id, for example Hopper-v5");
  check_output(options.output);
  std::vector<std::string> ignored;
  const Demonstrations demonstrations =
      demonstrations_of(read_table(options.input, ignored), options.environment);
  write_demonstrations(demonstrations, options.output);
  tell_ignored(options.input, ignored);
  describe_demonstrations(demonstrations, false, std::cout);
}

}  // namespace

void add_convert(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("convert", "Turn plain arrays (.npz, .csv) into demonstrations");
  const auto options = std::make_shared<Options>();
  command
      ->add_option(
          "ARRAYS", options->input,
          "One row a state, episode after episode; a missing action is NaN or an empty cell. .npz: "
          "observations, actions, episode_starts...; .csv: columns obs_0..., action_0..., "
          "episode...")
      ->required();
  command
      ->add_option("--out", options->output,
                   "x.hdf5: one file; any other name: a Minari dataset folder")
      ->required()
      ->check(not_empty());
  command->add_option("--env", options->environment, "The environment's Gymnasium id")->required();
  command->callback([options] { run(*options); });
}

}  // namespace agail
