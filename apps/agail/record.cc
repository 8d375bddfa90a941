// agail record: demonstrations from a policy.
#include <iostream>
#include <memory>

#include "agail/demos/minari_writer.h"
#include "agail/train/evaluation.h"
#include "commands.h"
#include "inspect_demos.h"
#include "option_checks.h"

namespace agail {
namespace {

struct Options {
  std::string policy, out;
  Index episodes = 0;
  std::uint64_t seed = 0;
  bool stochastic = false;
};

void run(const Options& options) {
  check_output(options.out);
  const SavedPolicy policy = SavedPolicy::load(policy_file(options.policy));
  ThreadPool pool(default_threads());
  const Demonstrations demos =
      record(policy, options.episodes, options.seed, options.stochastic, pool);
  write_demonstrations(demos, options.out);
  describe_demonstrations(demos, false, std::cout);
}

}  // namespace

void add_record(CLI::App& app) {
  CLI::App* command = app.add_subcommand("record", "Record demonstrations from a policy");
  const auto options = std::make_shared<Options>();
  command->add_option("POLICY", options->policy, "A run folder or a .safetensors file")->required();
  command->add_option("--episodes", options->episodes, "How many")
      ->required()
      ->check(whole_number(1, 1'000'000));
  command
      ->add_option("--out", options->out,
                   "x.hdf5: one file; any other name: a Minari dataset folder")
      ->required()
      ->check(not_empty());
  command->add_option("--seed", options->seed, "Names the episodes; default 0")->check(any_seed());
  command->add_flag("--stochastic", options->stochastic,
                    "Sample actions instead of taking the mode");
  command->callback([options] { run(*options); });
}

}  // namespace agail
