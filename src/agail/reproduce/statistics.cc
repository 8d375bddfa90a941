#include "agail/reproduce/statistics.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "agail/base/error.h"
#include "agail/base/random.h"

namespace agail {

namespace {

double squared_deviations(std::span<const double> values) {
  const double mean = mean_of(values);
  double sum = 0;
  for (const double v : values) sum += (v - mean) * (v - mean);
  return sum;
}

// Linear between the order statistics, as NumPy's default.
double percentile(const std::vector<double>& sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

void resample(const std::vector<double>& from, RandomStream& random, std::vector<double>& to) {
  to.clear();
  for (std::size_t i = 0; i < from.size(); ++i)
    to.push_back(from[random.below(static_cast<std::uint32_t>(from.size()))]);
}

double share_of_less(const std::vector<double>& first, const std::vector<double>& second) {
  double sum = 0;
  for (const double a : first)
    for (const double b : second) sum += a < b ? 1 : a == b ? 0.5 : 0;
  return sum / static_cast<double>(first.size() * second.size());
}

}  // namespace

double mean_of(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double standard_error_of(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  return n > 1 ? std::sqrt(squared_deviations(values) / (n - 1) / n) : 0;
}

double population_standard_error_of(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  return std::sqrt(squared_deviations(values) / n / n);
}

double interquartile_mean(std::vector<double> values) {
  AGAIL_CHECK(!values.empty());
  std::sort(values.begin(), values.end());
  const std::size_t cut = values.size() / 4;
  return mean_of(std::span(values).subspan(cut, values.size() - 2 * cut));
}

std::pair<double, double> interquartile_mean_interval(
    const std::vector<std::vector<double>>& strata, std::uint64_t seed) {
  constexpr std::size_t kResamples = 50'000;
  RandomStream random(seed, Purpose::kBootstrap, 1);
  std::vector<double> estimates;
  std::vector<double> drawn;
  for (std::size_t i = 0; i < kResamples; ++i) {
    drawn.clear();
    for (const std::vector<double>& stratum : strata)
      for (std::size_t j = 0; j < stratum.size(); ++j)
        drawn.push_back(stratum[random.below(static_cast<std::uint32_t>(stratum.size()))]);
    estimates.push_back(interquartile_mean(drawn));
  }
  std::sort(estimates.begin(), estimates.end());
  return {percentile(estimates, 0.025), percentile(estimates, 0.975)};
}

Estimate probability_of_less(const std::vector<std::vector<double>>& first,
                             const std::vector<std::vector<double>>& second, std::uint64_t seed) {
  AGAIL_CHECK(first.size() == second.size() && !first.empty());
  constexpr std::size_t kResamples = 2'000;
  RandomStream random(seed, Purpose::kBootstrap, 2);
  std::vector<double> estimates(kResamples), drawn_first, drawn_second;
  Estimate result;
  for (std::size_t s = 0; s < first.size(); ++s) {
    result.value += share_of_less(first[s], second[s]) / static_cast<double>(first.size());
    for (double& estimate : estimates) {
      resample(first[s], random, drawn_first);
      resample(second[s], random, drawn_second);
      estimate += share_of_less(drawn_first, drawn_second) / static_cast<double>(first.size());
    }
  }
  std::sort(estimates.begin(), estimates.end());
  result.low = percentile(estimates, 0.025);
  result.high = percentile(estimates, 0.975);
  return result;
}

}  // namespace agail
