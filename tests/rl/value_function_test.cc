#include "agail/rl/value_function.h"

#include <gtest/gtest.h>

#include "rl/support.h"

namespace agail {
namespace {

constexpr int kObservations = 3;
constexpr Index kSamples = 300;

struct Data {
  Matrix<float> x = reference::network_input(kObservations, kSamples, 1).cast<float>();
  Vector<float> targets =
      (x.row(0).array().sin() + x.row(1).array() * x.row(2).array()).transpose();
  double loss(ValueFunction& value) const {
    Vector<float> predicted(kSamples);
    value.predict(x, kSamples, predicted);
    return (predicted - targets).cast<double>().squaredNorm() / kSamples;
  }
};

// Rates of 1e-30 leave the following of mean and deviation as the only thing that fit() does.
TEST(ValueFunction, RescalingKeepsTheFunction) {
  ThreadPool pool(2);
  Data data;
  ValueSettings settings;
  settings.normalize_targets = true;
  settings.learning_rate = 1e-30;
  ValueFunction value(kObservations, settings, pool, kSamples, 1);
  Vector<float> before(kSamples), after(kSamples);
  value.predict(data.x, kSamples, before);
  EXPECT_GT(before.cwiseAbs().maxCoeff(), 0.01);
  const std::vector<float> scales{0.1F, 3, 100, 0.2F, 500};
  float largest = 1;  // rounding is relative to the mean that is taken off and added again
  for (std::uint32_t i = 0; i < scales.size(); ++i) {
    const Vector<float> targets = (data.targets.array() - 5) * scales[i];
    value.fit(data.x, targets, kSamples, i);
    value.predict(data.x, kSamples, after);
    EXPECT_LE((after - before).cwiseAbs().maxCoeff(),
              1e-5 * static_cast<double>(largest = std::max(largest, scales[i])));
  }
}

TEST(ValueFunction, FittingLowersTheLoss) {
  ThreadPool pool(2);
  for (const bool normalize : {false, true}) {
    for (const float scale : {1.0F, 300.0F}) {
      if (!normalize && scale > 1) continue;  // out of reach of a few steps of size 1e-3
      Data data;
      data.targets *= scale;
      ValueSettings settings;
      settings.normalize_targets = normalize;
      ValueFunction value(kObservations, settings, pool, kSamples, 1);
      double last = data.loss(value);
      const double start = last;
      for (std::uint32_t i = 0; i < 60; ++i) {
        value.fit(data.x, data.targets, kSamples, i);
        if (i % 20 != 19) continue;
        const double now = data.loss(value);
        EXPECT_LT(now, last);
        last = now;
      }
      EXPECT_LT(last, 0.05 * start);
    }
  }
}

TEST(ValueFunction, SameBitsForAnyNumberOfThreads) {
  const Data data;
  Vector<float> first(kSamples), values(kSamples);
  for (const int threads : {1, 2, 3, 8}) {
    ThreadPool pool(threads);
    ValueFunction value(kObservations, {}, pool, kSamples, 1);
    for (std::uint32_t i = 0; i < 3; ++i) value.fit(data.x, data.targets, kSamples, i);
    value.predict(data.x, kSamples, values);
    if (threads == 1) first = values;
    EXPECT_TRUE(reference::same_bits(values, first));
  }
}

TEST(ValueFunction, ContinuesFromAnArchive) {
  ThreadPool pool(2);
  const Data data;
  ValueSettings settings;
  settings.normalize_targets = true;
  ValueFunction whole(kObservations, settings, pool, kSamples, 1);
  ValueFunction rest(kObservations, settings, pool, kSamples, 2);
  whole.fit(data.x, data.targets, kSamples, 0);
  TensorStore store = archived(whole);
  Archive load(store, Archive::Mode::kLoad);
  rest.archive(load);
  whole.fit(data.x, 2 * data.targets, kSamples, 1);
  // The order of the minibatches belongs to the seed, so a network of another seed goes elsewhere.
  ValueFunction same(kObservations, settings, pool, kSamples, 1);
  same.archive(load);
  same.fit(data.x, 2 * data.targets, kSamples, 1);
  rest.fit(data.x, 2 * data.targets, kSamples, 1);
  EXPECT_TRUE(same_store(archived(whole), archived(same)));
  EXPECT_FALSE(same_store(archived(whole), archived(rest)));
}

}  // namespace
}  // namespace agail
