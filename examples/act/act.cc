// A policy in a program of its own: reads observations from standard input, one a line, and prints
// the policy's action for each. A robot's control loop looks like this, with sensors and motors in
// place of the two streams.
//
//   cmake -S . -B build -DCMAKE_PREFIX_PATH=/where/agail/is/installed && cmake --build build
//   build/act runs/hopper < observations.txt
#include <agail/policy.h>

#include <chrono>
#include <exception>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

namespace {

std::vector<double> numbers_of(const std::string& line) {
  std::istringstream stream(line);
  std::vector<double> numbers;
  for (double number = 0; stream >> number;) numbers.push_back(number);
  return numbers;
}

void act(const agail::Policy& policy) {
  using Clock = std::chrono::steady_clock;
  agail::Policy::Workspace workspace(policy);
  std::vector<float> action(policy.action_size());
  Clock::duration total{};
  long calls = 0;

  std::cout.precision(9);  // a float that is read back is the same
  for (std::string line; std::getline(std::cin, line); ++calls) {
    const std::vector<double> observation = numbers_of(line);
    const Clock::time_point begin = Clock::now();
    policy.act(observation, workspace, action);
    total += Clock::now() - begin;
    for (const float number : action) std::cout << number << ' ';
    std::cout << '\n';
  }
  if (calls > 0)
    std::cerr << std::chrono::duration<double, std::micro>(total).count() /
                     static_cast<double>(calls)
              << " us an action\n";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: act RUN-FOLDER|POLICY.safetensors < OBSERVATIONS\n";
    return 2;
  }
  try {
    const agail::Policy policy = agail::Policy::load(argv[1]);
    std::cerr << "policy for " << policy.environment() << ": " << policy.observation_size()
              << " observations, " << policy.action_size() << " numbers an action\n";
    act(policy);
  } catch (const std::exception& error) {
    std::cerr << "act: " << error.what() << '\n';
    return 1;
  }
}
