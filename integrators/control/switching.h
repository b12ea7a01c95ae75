#pragma once
#include <memory>
#include <vector>

#include "integrators/core/integrator.h"

/// Steps that respect where the field is not smooth.
namespace porthos::integrators {

/// Functions of the state at whose zeros the field or a derivative of it jumps: the depth of a
/// contact. Not shared between threads.
class Switches {
 public:
  virtual ~Switches() = default;
  virtual size_t count() const = 0;
  /// Their values. @param x  value + low word, size nx; @param turns  2π·turns of each angle block;
  /// value written, size count()
  virtual void at(std::span<const double> x, std::span<const double> turns,
                  std::span<double> value) = 0;
};

/// Options of the search for switches.
struct SwitchOptions {
  /// Points inside a step, besides its ends, at which the dense output is evaluated. Two zeros
  /// between neighbouring points are missed.
  int samples = 3;
  int most_trials = 60;  ///< re-steps per zero; 4 to 6 are usual
  int most_parts = 64;   ///< of one step; after them the rest is one part
};

/// A method whose steps consist of parts that end where a switch passes 0, so each part meets one
/// smooth field and the method keeps its order. The instants are those of EventStepper: the method
/// is run again up to the zero. The clock, records and sampled controllers see whole steps. A step
/// without a zero has the bits of the method alone. interpolate() has no dense output for a step
/// of several parts. model must outlive it; h, options: those of the inner method.
std::unique_ptr<Integrator> make_switched(std::unique_ptr<Integrator> inner,
                                          const phs::Model& model, double h,
                                          std::unique_ptr<Switches> switches,
                                          const SwitchOptions& how = {},
                                          const Options& options = {});

}  // namespace porthos::integrators
