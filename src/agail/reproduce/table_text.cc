// The table as text: for machines and for people.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "agail/reproduce/statistics.h"
#include "agail/reproduce/table.h"

namespace agail {

namespace {

std::string number(double value, int decimals) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

// 12345.6 as 12,346; small returns keep a decimal, counts none.
std::string readable(double value, int decimals = 1) {
  if (std::abs(value) < 1000) return number(value, decimals);
  std::string digits = std::to_string(std::llabs(std::llround(value)));
  for (auto at = static_cast<std::ptrdiff_t>(digits.size()) - 3; at > 0; at -= 3)
    digits.insert(static_cast<std::size_t>(at), ",");
  return (value < 0 ? "-" : "") + digits;
}

std::string readable(const std::optional<MeanAndError>& value) {
  return value ? readable(value->mean) + " ± " + readable(value->standard_error) : "-";
}

std::string percent(double share) { return number(100 * share, 1) + " %"; }

std::string ratio(const std::optional<double>& missing) {
  if (!missing) return "";
  std::string text = number(*missing, 2);
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

std::string method_name(const Cell& cell) {
  return cell.method == "agail" ? "agail, " + number(100 * *cell.missing, 0) + " % missing"
                                : cell.method;
}

std::string environment_table(std::span<const CellSummary> cells, const std::string& environment) {
  std::string text = "## " + environment + "\n\n" + "| method | seeds | paper (" +
                     table_environment(environment).paper_name +
                     (environment.starts_with("CartPole") ? "-v0" : "-v2") +
                     ") | the paper's statistic | last tenth of training | deterministic, mean | "
                     "IQM (95 % interval) | worst seed | share of expert | interactions to 95 % |\n"
                     "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
  for (const CellSummary& cell : cells) {
    if (cell.cell.environment != environment) continue;
    text += "| " + method_name(cell.cell) + " | " + std::to_string(cell.seeds) + " | " +
            readable(cell.paper) + " | " + readable(cell.training) + " | " + readable(cell.late) +
            " | " + readable(cell.mean()) + " | " + readable(cell.iqm) + " (" +
            readable(cell.iqm_low) + " to " + readable(cell.iqm_high) + ") | " +
            readable(cell.worst()) + " | " +
            (cell.share_of_expert() ? percent(*cell.share_of_expert()) : "-") + " | ";
    if (cell.expert_return)
      text += (cell.steps_to_95 ? readable(*cell.steps_to_95, 0) : "never") + " (" +
              std::to_string(cell.seeds_at_95) + " of " + std::to_string(cell.seeds) + ")";
    else
      text += "-";
    text += " |\n";
  }
  return text + "\n";
}

// A method over all environments, each return as a share of its expert's.
std::string overall(std::span<const CellSummary> cells) {
  std::vector<std::string> order;
  std::map<std::string, std::vector<std::vector<double>>> shares;
  for (const CellSummary& cell : cells) {
    if (!cell.share_of_expert()) continue;
    const std::string name = method_name(cell.cell);
    if (std::find(order.begin(), order.end(), name) == order.end()) order.push_back(name);
    std::vector<double> stratum;
    for (const double value : cell.deterministic) stratum.push_back(value / *cell.expert_return);
    shares[name].push_back(std::move(stratum));
  }
  if (order.empty()) return "";
  std::string text =
      "## All environments\n\nDeterministic return as a share of the expert's.\n\n"
      "| method | environments | IQM (95 % stratified bootstrap interval) |\n| --- | --- | --- |\n";
  for (const std::string& name : order) {
    std::vector<double> all;
    for (const auto& stratum : shares[name]) all.insert(all.end(), stratum.begin(), stratum.end());
    const auto [low, high] = interquartile_mean_interval(shares[name], 0);
    text += "| " + name + " | " + std::to_string(shares[name].size()) + " | " +
            percent(interquartile_mean(all)) + " (" + percent(low) + " to " + percent(high) +
            ") |\n";
  }
  return text + "\n";
}

// Do partial actions make imitation faster? Where the budget is long enough to tell.
std::string speed(std::span<const CellSummary> cells) {
  std::vector<std::vector<double>> agail, state_gail;
  std::string environments;
  for (const std::string environment : {"Hopper-v4", "Walker2d-v4"}) {
    const auto find = [&](const std::string& method, double missing) {
      return std::find_if(cells.begin(), cells.end(), [&](const CellSummary& c) {
        return c.cell == Cell{environment, method, missing} && !c.seeds_to_95.empty();
      });
    };
    const auto a = find("agail", 0.75), s = find("state-gail", 1);
    if (a == cells.end() || s == cells.end()) continue;
    agail.push_back(a->seeds_to_95);
    state_gail.push_back(s->seeds_to_95);
    environments += (environments.empty() ? "" : " and ") + environment;
  }
  if (agail.empty()) return "";
  const Estimate p = probability_of_less(agail, state_gail, 0);
  return "Probability that a run of agail with 75 % missing reaches 95 % of its expert earlier "
         "than "
         "one of state-gail on the same demonstrations (" +
         environments + "; never counts as infinitely late, a tie as half): " + percent(p.value) +
         ", 95 % stratified bootstrap interval " + percent(p.low) + " to " + percent(p.high) +
         ".\n\n";
}

std::string experts(const TableData& data) {
  if (data.demonstrations.empty()) return "";
  std::string text =
      "## Experts and demonstrations\n\n"
      "| environment | seed of the expert | its deterministic return | worst of 50 episodes | "
      "demonstrations | their mean return |\n| --- | --- | --- | --- | --- | --- |\n";
  for (const TableEnvironment& e : table_environments())
    for (const DemonstrationsRecord& d : data.demonstrations) {
      if (d.expert.environment != e.id) continue;
      text += "| " + e.id + " | " + std::to_string(d.expert.seed) + " | " +
              readable(d.expert.evaluation.mean_return) + " | " +
              readable(d.expert.evaluation.worst_return) + " | " +
              std::to_string(d.choice.episodes) + " episodes of " +
              (d.choice.sampled ? "sampled actions" : "the mean action") + ", " +
              readable(static_cast<double>(d.transitions), 0) + " steps | " +
              readable(d.mean_return) + " |\n";
    }
  return text;
}

}  // namespace

std::string table_csv(std::span<const CellSummary> cells) {
  std::string text =
      "environment,method,missing,paper_mean,paper_standard_error,mean,standard_error,"
      "deterministic_mean,iqm,iqm_low,iqm_high,worst_seed,share_of_expert,steps_to_95\n";
  // More digits than table.md shows, so that who rounds them gets the same.
  const auto precise = [](double value) { return number(value, 4); };
  const auto pair = [&](const std::optional<MeanAndError>& value) {
    return value ? precise(value->mean) + "," + precise(value->standard_error) : ",";
  };
  for (const CellSummary& cell : cells)
    text += cell.cell.environment + "," + cell.cell.method + "," + ratio(cell.cell.missing) + "," +
            pair(cell.paper) + "," + pair(cell.training) + "," + precise(cell.mean()) + "," +
            precise(cell.iqm) + "," + precise(cell.iqm_low) + "," + precise(cell.iqm_high) + "," +
            precise(cell.worst()) + "," +
            (cell.share_of_expert() ? precise(*cell.share_of_expert()) : "") + "," +
            (cell.steps_to_95 ? number(*cell.steps_to_95, 0) : "") + "\n";
  return text;
}

std::string table_markdown(const TableData& data, std::span<const CellSummary> cells) {
  std::string presets;
  for (const RunRecord& run : data.runs)
    if (presets.find(run.preset) == std::string::npos)
      presets += (presets.empty() ? "" : ", ") + run.preset;
  std::string text =
      "# Table 1, preset " + presets + "\n\n" + std::to_string(data.runs.size()) +
      " runs. Made by `agail reproduce table1`; what the columns mean and what was chosen where "
      "the "
      "paper is silent: docs/reproduce.md. The paper's MuJoCo environments were the older v2; "
      "these "
      "are v4. \"The paper's statistic\" is mean ± standard error over the seeds of the smoothed "
      "returns of stochastic training episodes at the end of the budget.\n\n";
  for (const TableEnvironment& e : table_environments())
    if (std::any_of(cells.begin(), cells.end(),
                    [&](const CellSummary& c) { return c.cell.environment == e.id; }))
      text += environment_table(cells, e.id);
  return text + overall(cells) + speed(cells) + experts(data);
}

}  // namespace agail
