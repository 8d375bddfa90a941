#include "agail/demos/mask.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "agail/base/error.h"
#include "agail/base/random.h"

namespace agail {
namespace {

using Indices = std::vector<Eigen::Index>;

// round(ratio * count), halves up. The small term lifts halves that the product's rounding has
// lowered (0.29 * 50 is 14.499999999999998).
Eigen::Index share_of(double ratio, Eigen::Index count) {
  const double exact = ratio * static_cast<double>(count);
  return std::min(count, static_cast<Eigen::Index>(std::floor(exact + 0.5 + 1e-9)));
}

RandomStream stream(const MaskOptions& options, std::size_t episode = 0) {
  return RandomStream(options.seed, Purpose::kMask, static_cast<std::uint32_t>(options.pattern),
                      static_cast<std::uint32_t>(episode));
}

Indices shuffled(Eigen::Index count, RandomStream& random) {
  Indices order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  shuffle(order, random);
  return order;
}

// All steps of an episode, run after run, the runs in random order. The grid of runs starts at a
// random phase, so that no step is always the first of a run; this leaves shorter runs at the
// episode's two ends.
Indices block_order(Eigen::Index steps, RandomStream& random) {
  const Eigen::Index phase = random.below(static_cast<std::uint32_t>(kMaskBlockSteps));
  const Eigen::Index runs = (steps + phase + kMaskBlockSteps - 1) / kMaskBlockSteps;
  Indices order;
  order.reserve(static_cast<std::size_t>(steps));
  for (const Eigen::Index run : shuffled(runs, random)) {
    const Eigen::Index begin = std::max<Eigen::Index>(0, run * kMaskBlockSteps - phase);
    const Eigen::Index end = std::min(steps, (run + 1) * kMaskBlockSteps - phase);
    for (Eigen::Index t = begin; t < end; ++t) order.push_back(t);
  }
  return order;
}

void remove(DemoEpisode& episode, Eigen::Index step, Eigen::Index channel, bool discrete) {
  episode.available(step, channel) = 0;
  episode.actions(step, channel) = discrete ? 0.0 : std::numeric_limits<double>::quiet_NaN();
}

void remove_step(DemoEpisode& episode, Eigen::Index step, bool discrete) {
  for (Eigen::Index channel = 0; channel < episode.actions.cols(); ++channel)
    remove(episode, step, channel, discrete);
}

void remove_steps(Demonstrations& demonstrations, const MaskOptions& options) {
  for (std::size_t i = 0; i < demonstrations.episodes.size(); ++i) {
    DemoEpisode& episode = demonstrations.episodes[i];
    RandomStream random = stream(options, i);
    const Indices order = options.pattern == MaskPattern::kStep
                              ? shuffled(episode.steps(), random)
                              : block_order(episode.steps(), random);
    const auto count = static_cast<std::size_t>(share_of(options.ratio, episode.steps()));
    for (std::size_t k = 0; k < count; ++k)
      remove_step(episode, order[k], demonstrations.action.discrete);
  }
}

void remove_episodes(Demonstrations& demonstrations, const MaskOptions& options) {
  RandomStream random = stream(options);
  const double target = options.ratio * static_cast<double>(demonstrations.transitions());
  Eigen::Index removed = 0;
  for (const Eigen::Index i :
       shuffled(static_cast<Eigen::Index>(demonstrations.episodes.size()), random)) {
    DemoEpisode& episode = demonstrations.episodes[static_cast<std::size_t>(i)];
    // One more only if that comes at least as close to the target; the distance falls and then
    // grows, so stop there.
    const double without = target - static_cast<double>(removed);
    const double with = static_cast<double>(removed + episode.steps()) - target;
    if (options.ratio <= 0 || with > without + 1e-9) break;
    for (Eigen::Index t = 0; t < episode.steps(); ++t)
      remove_step(episode, t, demonstrations.action.discrete);
    removed += episode.steps();
  }
}

void remove_dimensions(Demonstrations& demonstrations, const MaskOptions& options) {
  if (options.ratio <= 0) return;
  RandomStream random = stream(options);
  Indices order = shuffled(demonstrations.action.dim, random);
  Eigen::Index count = share_of(options.ratio, demonstrations.action.dim);
  if (options.dimension) {
    const auto chosen = std::find(order.begin(), order.end(), Eigen::Index{*options.dimension});
    std::rotate(order.begin(), chosen, chosen + 1);
    count = std::max<Eigen::Index>(count, 1);
  }
  for (Eigen::Index k = 0; k < count; ++k)
    for (DemoEpisode& episode : demonstrations.episodes)
      for (Eigen::Index t = 0; t < episode.steps(); ++t)
        remove(episode, t, order[static_cast<std::size_t>(k)], demonstrations.action.discrete);
}

void check(const Demonstrations& demonstrations, const MaskOptions& options) {
  if (!(options.ratio >= 0 && options.ratio <= 1))
    throw InputError("the missing ratio is a share of the actions, from 0 (none) to 1 (all)");
  const ActionSpace& action = demonstrations.action;
  if (action.dim == 0)
    throw InputError("these demonstrations have no actions at all, so none can be removed");
  if (options.pattern != MaskPattern::kDimension) {
    if (options.dimension) throw InputError("--dimension goes with --pattern dimension only");
    return;
  }
  if (action.discrete)
    throw InputError("discrete actions have no dimensions; use the pattern step, block or episode");
  if (options.dimension && (*options.dimension < 0 || *options.dimension >= action.dim))
    throw InputError("there is no action dimension " + std::to_string(*options.dimension) +
                     "; these actions have the dimensions 0 to " + std::to_string(action.dim - 1));
}

}  // namespace

MaskPattern mask_pattern(const std::string& name) {
  for (const MaskPattern pattern :
       {MaskPattern::kStep, MaskPattern::kBlock, MaskPattern::kEpisode, MaskPattern::kDimension})
    if (name == name_of(pattern)) return pattern;
  throw InputError("there is no pattern '" + name +
                   "'; the patterns are step, block, episode and dimension");
}

const char* name_of(MaskPattern pattern) {
  switch (pattern) {
    case MaskPattern::kStep:
      return "step";
    case MaskPattern::kBlock:
      return "block";
    case MaskPattern::kEpisode:
      return "episode";
    case MaskPattern::kDimension:
      return "dimension";
  }
  AGAIL_CHECK(false);
}

void remove_actions(Demonstrations& demonstrations, const MaskOptions& options) {
  check(demonstrations, options);
  const double before = demonstrations.missing_ratio();
  switch (options.pattern) {
    case MaskPattern::kStep:
    case MaskPattern::kBlock:
      remove_steps(demonstrations, options);
      break;
    case MaskPattern::kEpisode:
      remove_episodes(demonstrations, options);
      break;
    case MaskPattern::kDimension:
      remove_dimensions(demonstrations, options);
      break;
  }
  if (demonstrations.missing_ratio() <= before) return;  // nothing was removed: nothing to tell
  const std::string name = name_of(options.pattern);
  std::string& pattern = demonstrations.pattern;
  if (pattern.empty()) {
    pattern = name;
  } else if (("+" + pattern + "+").find("+" + name + "+") == std::string::npos) {
    pattern += "+" + name;
  }
}

}  // namespace agail
