// agail eval: how good a policy is.
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "agail/train/evaluation.h"
#include "commands.h"
#include "option_checks.h"

namespace agail {
namespace {

struct Options {
  std::string policy;
  Index episodes = 50;
  std::uint64_t seed = 0;
  bool stochastic = false, json = false;
};

void run(const Options& options) {
  const SavedPolicy policy = SavedPolicy::load(policy_file(options.policy));
  ThreadPool pool(default_threads());
  const Evaluation evaluation =
      evaluate(policy, options.episodes, options.seed, options.stochastic, pool);
  const auto [low, high] = bootstrap_interval(evaluation.returns, options.seed);
  const auto [shortest, longest] =
      std::minmax_element(evaluation.lengths.begin(), evaluation.lengths.end());
  const std::optional<double>& demonstrations = policy.info().demonstrations_mean_return;
  // Where the demonstrations' return is negative, a worse policy would have the larger share.
  const auto share = demonstrations && *demonstrations > 0
                         ? std::optional(evaluation.mean_return() / *demonstrations)
                         : std::nullopt;
  if (options.json) {
    const nlohmann::ordered_json result = {
        {"environment", policy.info().environment},
        {"method", policy.info().method},
        {"episodes", evaluation.returns.size()},
        {"deterministic", !options.stochastic},
        {"mean_return", evaluation.mean_return()},
        {"standard_error", evaluation.standard_error()},
        {"confidence_interval_95", {low, high}},
        {"mean_length", evaluation.mean_length()},
        {"min_length", *shortest},
        {"max_length", *longest},
        {"diverged", evaluation.diverged},
        {"share_of_demonstrations",
         share ? nlohmann::ordered_json(*share) : nlohmann::ordered_json(nullptr)},
        {"returns", evaluation.returns}};
    std::cout << result.dump(2) << "\n";
    return;
  }
  std::printf("%s, %s, %zu %s episodes\n", policy.info().environment.c_str(),
              policy.info().method.c_str(), evaluation.returns.size(),
              options.stochastic ? "stochastic" : "deterministic");
  std::printf("  return   %.1f +- %.1f (standard error), 95 %% interval of the mean %.1f to %.1f\n",
              evaluation.mean_return(), evaluation.standard_error(), low, high);
  std::printf("  length   %.1f (%.0f to %.0f)\n", evaluation.mean_length(), *shortest, *longest);
  if (share)
    std::printf("  share    %.1f %% of the demonstrations' %.1f\n", 100 * *share, *demonstrations);
  if (evaluation.diverged > 0)
    std::printf("  diverged %lld episodes ended in a broken simulation\n",
                static_cast<long long>(evaluation.diverged));
}

}  // namespace

void add_eval(CLI::App& app) {
  CLI::App* command = app.add_subcommand("eval", "Evaluate a policy");
  const auto options = std::make_shared<Options>();
  command->add_option("POLICY", options->policy, "A run folder or a .safetensors file")->required();
  command->add_option("--episodes", options->episodes, "Default 50")
      ->check(whole_number(1, 1'000'000));
  command->add_option("--seed", options->seed, "Names the episodes; default 0")->check(any_seed());
  command->add_flag("--stochastic", options->stochastic,
                    "Sample actions instead of taking the mode");
  command->add_flag("--json", options->json, "Print JSON");
  command->callback([options] { run(*options); });
}

}  // namespace agail
