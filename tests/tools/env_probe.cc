// Steps agail's environments for the comparison with Gymnasium (tests/python/test_env_parity.py).
//
//   env_probe specs       one line an environment, as text
//   env_probe step ID     stdin: records (saved state, action); stdout: records (observation,
//   reward, terminated,
//                         truncated, diverged) of one step from that state
//   env_probe reset ID    stdin: seeds; stdout: the state saved after a reset from each
//
// Records are doubles in the machine's byte order.
#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
#include <vector>

#include "agail/env/environment.h"

namespace {

using agail::Environment;

bool read(std::vector<double>& values) {
  return std::fread(values.data(), sizeof(double), values.size(), stdin) == values.size();
}

void write(std::span<const double> values) {
  std::fwrite(values.data(), sizeof(double), values.size(), stdout);
}

// id, observation size, float32 observations?, discrete?, action size, step limit, saved size,
// lows, highs.
void print_specs() {
  for (const std::string& id : agail::environment_ids()) {
    const agail::EnvironmentSpec spec = agail::environment_spec(id);
    const auto env = agail::make_environment(id);
    std::printf("%s %d %d %d %d %d %zu", id.c_str(), spec.observation_dim,
                spec.observation_is_float32, spec.action.discrete,
                spec.action.discrete ? spec.action.n : spec.action.dim, spec.max_episode_steps,
                env->save().size());
    for (const float v : spec.action.low) std::printf(" %.9g", static_cast<double>(v));
    for (const float v : spec.action.high) std::printf(" %.9g", static_cast<double>(v));
    std::printf("\n");
  }
}

void step(Environment& env) {
  std::vector<double> state(env.save().size());
  std::vector<double> action(static_cast<std::size_t>(env.spec().action.dim));
  while (read(state) && read(action)) {
    env.restore(state);
    const agail::StepResult result = env.step(std::vector<float>(action.begin(), action.end()));
    write(env.observation());
    write(std::vector<double>{result.reward, result.terminated ? 1.0 : 0.0,
                              result.truncated ? 1.0 : 0.0, result.diverged ? 1.0 : 0.0});
  }
}

void reset(Environment& env) {
  std::vector<double> seed(1);
  while (read(seed)) {
    agail::RandomStream random(static_cast<std::uint64_t>(seed[0]), agail::Purpose::kReset);
    env.reset(random);
    write(env.save());
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  if (what == "specs" && argc == 2) {
    print_specs();
  } else if ((what == "step" || what == "reset") && argc == 3) {
    const auto env = agail::make_environment(argv[2]);
    what == "step" ? step(*env) : reset(*env);
  } else {
    std::fprintf(stderr, "usage: env_probe specs | step ID | reset ID\n");
    return 2;
  }
  return 0;
}
