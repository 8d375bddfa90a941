// agail convert: plain arrays to demonstrations.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>

#include "agail/base/error.h"
#include "agail/demos/csv_table.h"
#include "agail/demos/gymnasium_spec.h"
#include "agail/demos/minari_writer.h"
#include "agail/demos/npz_table.h"
#include "agail/env/environment.h"
#include "commands.h"
#include "inspect_demos.h"

namespace agail {
namespace {

struct Options {
  std::string input;
  std::string output;
  std::string environment;
};

StepTable read_table(const std::string& path) {
  std::vector<std::string> ignored;
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension != ".npz" && extension != ".csv")
    throw InputError(path + " is neither a .npz nor a .csv file; save the arrays as one of these");
  StepTable table = extension == ".npz" ? read_npz(path, ignored) : read_csv(path, ignored);
  if (!ignored.empty()) {
    std::cerr << "ignored in " << path << ":";
    for (const std::string& name : ignored) std::cerr << " " << name;
    std::cerr << "\n";
  }
  return table;
}

void run(const Options& options) {
  if (!is_gymnasium_id(options.environment))
    throw InputError("'" + options.environment +
                     "' is no Gymnasium id; give one such as Hopper-v5");
  StepTable table = read_table(options.input);
  std::optional<ActionSpace> known;
  const std::vector<std::string> ids = environment_ids();
  if (std::find(ids.begin(), ids.end(), options.environment) != ids.end()) {
    const EnvironmentSpec spec = environment_spec(options.environment);
    if (table.observations.cols() != spec.observation_dim)
      throw InputError(options.input + " has observations of " +
                       std::to_string(table.observations.cols()) + " numbers, " +
                       options.environment + " of " + std::to_string(spec.observation_dim));
    known = spec.action;
    table.observations_are_float32 = spec.observation_is_float32;
  }
  const Demonstrations demonstrations = demonstrations_from(table, options.environment, known);
  write_demonstrations(demonstrations, options.output);
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
      ->required();
  command->add_option("--env", options->environment, "The environment's Gymnasium id")->required();
  command->callback([options] { run(*options); });
}

}  // namespace agail
