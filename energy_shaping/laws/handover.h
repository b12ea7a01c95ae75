#pragma once
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "energy_shaping/loop/port_law.h"
#include "phs/functions/gate.h"

namespace porthos::energy_shaping {

/// The set {V < level} around a rest point. V falls in it along the plant under the law of the rest
/// point, so what is inside stays.
struct LevelSet {
  std::function<double(std::span<const double> x)> V;  ///< thread-safe
  double level = 0;
  /// Of 100 runs from where V has a higher level, how many do not come back into the level set.
  std::function<int(double higher)> lost = nullptr;
  std::vector<PortLaw> laws = {};       ///< of the rest point; empty: not told
  static constexpr int most_lost = 20;  ///< of these 100, where a higher level may be used
};

/// What a run says of the first law if it has not handed over.
struct Progress {
  struct At {
    double energy = 0;     ///< [J]
    bool limited = false;  ///< the law is at its limit
  };
  std::function<At(std::span<const double> x)> at;  ///< thread-safe
  /// The cause and the remedy, as parts of a sentence. settled: mean of the energy over the last
  /// half of the samples or more; limited: share of all samples
  std::function<std::string(double settled, double limited)> cause, remedy;
  /// Settings that hand over, found by runs, in place of that remedy; empty: nothing is known.
  /// Null: none are tried. For notes: seconds
  std::function<std::string(const LevelSet& basin, double leave)> settings = nullptr;
};

/// One sampled law hands over to another when the state comes into the basin of the second, V <
/// level, and takes back when it has left it by a factor, V > leave · level: a hysteresis, so that
/// the two do not alternate at the border. Between two sampling instants nothing changes. Both
/// controllers, and each port of them, keep the same memory of their own.
class Handover {
 public:
  /// @param leave  more than 1
  /// @param of     the first law; empty: nothing is told of it
  /// @throws InvalidArgument for a level or a factor out of range
  Handover(std::string from, std::string to, LevelSet basin, double leave, Progress of = {});

  const phs::GatePtr& from() const { return from_; }  ///< open while the first law acts
  const phs::GatePtr& to() const { return to_; }      ///< open while the second one does

 private:
  phs::GatePtr from_, to_;
};

}  // namespace porthos::energy_shaping
