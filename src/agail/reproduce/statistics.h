// What is said of several seeds (Agarwal et al., "Deep Reinforcement Learning at the Edge of the
// Statistical Precipice", NeurIPS 2021; the package rliable).
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace agail {

double mean_of(std::span<const double> values);
// sd / sqrt(n), with the sample's or the population's standard deviation. 0 for one value.
double standard_error_of(std::span<const double> values);
double population_standard_error_of(std::span<const double> values);

// Mean of the middle half: the floor(n / 4) smallest and as many largest values are left out.
double interquartile_mean(std::vector<double> values);

// 95 % interval of the interquartile mean over all strata together (percentile method, 50,000
// resamples): each stratum, the seeds of one environment, is resampled by itself.
std::pair<double, double> interquartile_mean_interval(
    const std::vector<std::vector<double>>& strata, std::uint64_t seed);

struct Estimate {
  double value = 0, low = 0, high = 0;  // the 95 % interval
};

// Probability that a draw of `first` is smaller than one of `second` (a tie counts half), the mean
// over the strata; the interval as above, from 2,000 resamples of both. Values may be infinite.
// first and second: as many strata each, none empty.
Estimate probability_of_less(const std::vector<std::vector<double>>& first,
                             const std::vector<std::vector<double>>& second, std::uint64_t seed);

}  // namespace agail
