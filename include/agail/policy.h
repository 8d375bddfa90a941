// agail's installed C++ API: a trained policy that acts. Needs neither MuJoCo nor HDF5.
//
//   find_package(agail REQUIRED)
//   target_link_libraries(robot PRIVATE agail::agail)
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace agail {

// Immutable; copies share it, and several threads may use one.
class Policy {
 public:
  // A run folder, or a .safetensors file. std::runtime_error, one line that says what is wrong and
  // how to mend it, if it holds no policy or a damaged one.
  static Policy load(const std::string& path);

  // Space for one caller: a thread has its own, used for one call after another.
  class Workspace {
   public:
    explicit Workspace(const Policy& policy);
    ~Workspace();
    Workspace(Workspace&&) noexcept;
    Workspace& operator=(Workspace&&) noexcept;

   private:
    friend class Policy;
    struct State;
    std::unique_ptr<State> state_;
  };

  // The deterministic action for one observation, as the environment gives it (normalisation is
  // inside); allocates nothing. `observation`: observation_size() values; `action`: action_size()
  // values, within the bounds; discrete: the action's index, counted from 0.
  // std::invalid_argument for other sizes.
  void act(std::span<const double> observation, Workspace& workspace,
           std::span<float> action) const;

  // The same with a workspace of its own.
  std::vector<float> act(std::span<const double> observation) const;

  std::size_t observation_size() const;
  std::size_t action_size() const;  // 1 if discrete
  bool discrete() const;
  int actions() const;                           // number of discrete actions, else 0
  const std::vector<float>& action_low() const;  // bounds of continuous actions, perhaps infinite
  const std::vector<float>& action_high() const;
  const std::string& environment() const;  // id of the environment that it was trained for

 private:
  struct Implementation;
  explicit Policy(std::shared_ptr<const Implementation> implementation);
  std::shared_ptr<const Implementation> implementation_;
};

}  // namespace agail
