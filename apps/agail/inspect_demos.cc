#include "inspect_demos.h"

#include <algorithm>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

namespace agail {
namespace {

using nlohmann::ordered_json;

double complete_steps(const Demonstrations& demonstrations) {
  if (demonstrations.action.dim == 0 || demonstrations.transitions() == 0) return 0;
  Eigen::Index complete = 0;
  for (const DemoEpisode& episode : demonstrations.episodes)
    for (Eigen::Index t = 0; t < episode.steps(); ++t)
      complete += (episode.available.row(t).array() == 1).all();
  return static_cast<double>(complete) / static_cast<double>(demonstrations.transitions());
}

ordered_json summary(const Demonstrations& demonstrations) {
  Eigen::Index shortest =
      demonstrations.episodes.empty() ? 0 : demonstrations.episodes.front().steps();
  Eigen::Index longest = 0;
  for (const DemoEpisode& episode : demonstrations.episodes) {
    shortest = std::min(shortest, episode.steps());
    longest = std::max(longest, episode.steps());
  }
  const auto text_or_null = [](const std::string& text) {
    return text.empty() ? ordered_json() : ordered_json(text);
  };
  const auto episodes = demonstrations.episodes.size();
  const double mean = episodes == 0 ? 0.0
                                    : static_cast<double>(demonstrations.transitions()) /
                                          static_cast<double>(episodes);
  return {{"environment", text_or_null(demonstrations.environment)},
          {"episodes", episodes},
          {"transitions", demonstrations.transitions()},
          {"missing_ratio", demonstrations.missing_ratio()},
          {"mean_return", demonstrations.has_rewards() ? ordered_json(demonstrations.mean_return())
                                                       : ordered_json()},
          {"observation_dim", demonstrations.observation_dim},
          {"action_dim", demonstrations.action.dim},
          {"actions",
           demonstrations.action.discrete ? ordered_json(demonstrations.action.n) : ordered_json()},
          {"pattern", text_or_null(demonstrations.pattern)},
          {"complete_steps", complete_steps(demonstrations)},
          {"lengths", {{"min", shortest}, {"mean", mean}, {"max", longest}}}};
}

std::string percent(double share) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << 100 * share << " %";
  return text.str();
}

}  // namespace

void describe_demonstrations(const Demonstrations& demonstrations, bool json, std::ostream& out) {
  const ordered_json facts = summary(demonstrations);
  if (json) {
    out << facts.dump(2, ' ', false, ordered_json::error_handler_t::replace) << "\n";
    return;
  }
  const ordered_json& lengths = facts["lengths"];
  const ActionSpace& action = demonstrations.action;
  out << "demonstrations of "
      << (demonstrations.environment.empty() ? "an unnamed environment"
                                             : demonstrations.environment)
      << "\n  episodes      " << facts["episodes"] << " of " << lengths["min"] << " to "
      << lengths["max"] << " steps (mean " << std::fixed << std::setprecision(1)
      << lengths["mean"].get<double>() << "), " << facts["transitions"]
      << " transitions\n  observations  " << demonstrations.observation_dim
      << " numbers\n  actions       ";
  if (action.dim == 0) {
    out << "none in the file\n";
  } else if (action.discrete) {
    out << "discrete, " << action.n << "\n";
  } else {
    out << action.dim << " numbers\n";
  }
  out << "  missing       " << percent(demonstrations.missing_ratio()) << " of the action entries"
      << (demonstrations.pattern.empty() ? "" : " (pattern " + demonstrations.pattern + ")") << "; "
      << percent(facts["complete_steps"])
      << " of the steps have their whole action\n  mean return   ";
  if (demonstrations.has_rewards()) {
    out << std::setprecision(2) << demonstrations.mean_return() << "\n";
  } else {
    out << "unknown, the file has no rewards\n";
  }
}

}  // namespace agail
