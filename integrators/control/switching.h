#pragma once
#include <memory>
#include <vector>

#include "integrators/core/integrator.h"

/// Steps that respect where the field is not smooth.
namespace porthos::integrators {

/// Functions of time and state at whose zeros the field or a derivative of it jumps: the depth of a
/// contact. Some may jump the state itself: they count as negative wherever a part of a step
/// begins, and let it jump where they come to 0. Not shared between threads.
class Switches {
 public:
  using State = phs::State;
  virtual ~Switches() = default;
  virtual size_t count() const = 0;
  /// Their values. @param x  value + low word, size nx; @param turns  2π·turns of each angle block;
  /// value written, size count()
  virtual void at(double t, std::span<const double> x, std::span<const double> turns,
                  std::span<double> value) = 0;

  /// Whether the state jumps where value k comes to 0 from below.
  virtual bool jumps(size_t k) const {
    (void)k;
    return false;
  }
  /// A step begins at time t. Takes off its state what has been added since the last one, by the
  /// kick of a splitting, to conditions that hold.
  virtual void begin_step(double t, State& state) {
    (void)t;
    (void)state;
  }
  /// Rates of those that jump [value/s]; rate written, size count()
  virtual void rates(std::span<const double> x, std::span<const double> turns,
                     std::span<double> rate) {
    (void)x;
    (void)turns;
    (void)rate;
  }
  /// The jump at time t of a state where value k is 0. Adds the energies of the jump to works, one
  /// for each power of the system, if there are any.
  /// @return  not ok: the step fails
  virtual Outcome jump(size_t k, double t, State& state, std::span<double> works) {
    (void)k;
    (void)t;
    (void)state;
    (void)works;
    return Outcome::ok;
  }
  /// Jumps since the step began, in order.
  virtual std::span<const Jump> jumped() const { return {}; }
  /// Takes off what a part of a step has added to conditions that hold in it.
  virtual void settle(State& state) { (void)state; }
  /// Why the last step failed, if it was because of them: then it ends with Outcome::jammed.
  virtual std::string trouble() const { return {}; }
  /// What a next step depends on.
  virtual void carry(Archive& archive) { (void)archive; }
};

/// Options of the search for switches.
struct SwitchOptions {
  /// Points inside a step, besides its ends, at which the dense output is evaluated. Two zeros
  /// between neighbouring points are missed.
  int samples = 3;
  int most_trials = 60;    ///< re-steps per zero; 4 to 6 are usual
  int most_parts = 64;     ///< of one step; after them the rest is one part
  int most_jumps = 10000;  ///< of one step; more: the step fails
};

/// A method whose steps consist of parts that end where a switch passes 0, so each part meets one
/// smooth field and the method keeps its order. The instants are those of EventStepper: the method
/// is run again up to the zero. The clock, records and sampled controllers see whole steps. A step
/// without a zero has the bits of the method alone. interpolate() has no dense output for a step
/// of several parts. The works of jumps are port work of the step. model must outlive it; h,
/// options: those of the inner method.
std::unique_ptr<Integrator> make_switched(std::unique_ptr<Integrator> inner,
                                          const phs::Model& model, double h,
                                          std::unique_ptr<Switches> switches,
                                          const SwitchOptions& how = {},
                                          const Options& options = {});

}  // namespace porthos::integrators
