#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mechanics/mechanism.h"
#include "phs/system/state.h"

namespace porthos::scene {

struct Assembly;
struct RunReport;

/// Whether the rates of joints at the ends of steps are those by which their coordinates move. They
/// are not where a force damps a joint faster than a step and the method does not follow it. The
/// coordinate then rests. Its rate only changes its sign at each step, or is that of the last kick.
class EndRates {
 public:
  /// Of joints of one number, in a system with sources or losses. The assembly must outlive it.
  explicit EndRates(const Assembly& assembly);
  bool any() const { return !joints_.empty(); }
  /// Adds a step of h seconds. Cost: two passes for the rates. Allocates nothing.
  void see(const phs::State& before, const phs::State& after, double h);
  /// Adds a note on joints that rest at more than a quarter of the steps seen although they have
  /// rates there; names the fastest. An undamped oscillation also seems to rest if a step is a
  /// multiple of half its period and begins where it passes the middle.
  void fill(RunReport& report) const;
  bool ring() const;  ///< whether there is such a joint

  /// Four numbers a joint.
  const std::vector<double>& memory() const { return memory_; }
  /// @throws InvalidArgument if the size does not fit
  void restore(std::span<const double> memory);

 private:
  struct Joint {
    std::string name;
    size_t q, v;
    std::optional<size_t> turn;  ///< none: a slide
  };
  void find_rates(const phs::State& s);
  bool rests(size_t joint) const;  ///< at more than a quarter of the steps seen
  const mechanics::Mechanism* mechanism_ = nullptr;
  std::optional<mechanics::Workspace<double>> workspace_;
  std::vector<Joint> joints_;
  std::vector<double> rates_, memory_;
};

}  // namespace porthos::scene
