// agail mask: removes actions from demonstrations.
#include "agail/demos/mask.h"

#include <iostream>
#include <memory>

#include "agail/demos/minari_reader.h"
#include "agail/demos/minari_writer.h"
#include "commands.h"
#include "inspect_demos.h"
#include "option_checks.h"

namespace agail {
namespace {

struct Options {
  std::string input;
  std::string output;
  std::string pattern = "step";
  double ratio = 0;
  std::uint64_t seed = 0;
  int dimension = -1;
};

void run(const Options& options, bool has_dimension) {
  MaskOptions mask;
  mask.pattern = mask_pattern(options.pattern);
  mask.ratio = options.ratio;
  mask.seed = options.seed;
  if (has_dimension) mask.dimension = options.dimension;
  check_output(options.output);
  Demonstrations demonstrations = read_demonstrations(options.input);
  remove_actions(demonstrations, mask);
  write_demonstrations(demonstrations, options.output);
  describe_demonstrations(demonstrations, false, std::cout);
}

}  // namespace

void add_mask(CLI::App& app) {
  CLI::App* command = app.add_subcommand("mask", "Remove actions from demonstrations");
  const auto options = std::make_shared<Options>();
  command
      ->add_option("FILE", options->input,
                   "A .hdf5 file, a Minari dataset folder or a Minari dataset id")
      ->required();
  command
      ->add_option(
          "--missing", options->ratio,
          "Share of the action entries to remove, 0 to 1; what is missing already stays missing")
      ->required()
      ->check(not_empty());
  command
      ->add_option("--out", options->output,
                   "x.hdf5: one file; any other name: a Minari dataset folder")
      ->required()
      ->check(not_empty());
  command
      ->add_option("--pattern", options->pattern,
                   "step: single steps; block: runs of 20 steps; episode: whole episodes; "
                   "dimension: whole action "
                   "channels")
      ->capture_default_str();
  CLI::Option* dimension =
      command
          ->add_option("--dimension", options->dimension,
                       "With --pattern dimension: the channel to remove first, from 0")
          ->check(whole_number(0, std::numeric_limits<int>::max()));
  command
      ->add_option("--seed", options->seed,
                   "Which entries go; a larger share contains a smaller one")
      ->capture_default_str()
      ->check(any_seed());
  command->callback([options, dimension] { run(*options, dimension->count() > 0); });
}

}  // namespace agail
