#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "phs/state.h"
#include "phs/system.h"

/// Time integrators. They know the system contract of phs/ and nothing of mechanics.
namespace porthos::integrators {

/// What a method says of a property. The test suite checks every `holds` and, with a negative control, every `fails`.
enum class Claim { holds, fails, unknown };
const char* to_string(Claim c);

/// What a method keeps, for lossless systems unless said otherwise.
struct Declaration {
  std::string name;   ///< "gauss16": the name in scenes
  std::string title;  ///< a line for people
  int order;          ///< 0: varies with a tolerance
  Claim symmetric;    ///< step(h) then step(-h) is the identity
  Claim symplectic;
  Claim energy_exact;          ///< H kept to rounding for any H
  Claim passivity_exact;       ///< the discrete power balance closes to rounding for any H
  Claim quadratic_invariants;  ///< linear and quadratic invariants kept to rounding
  bool resumable;              ///< a run can be continued bit for bit from a checkpoint
  std::string source;
};

/// How a step ended. Anything but `ok` leaves the state as it was.
enum class Outcome { ok, not_converged, not_finite, failed };
const char* to_string(Outcome o);

struct Cost {
  std::int64_t steps = 0;
  std::int64_t evaluations = 0;  ///< of the field for one state
  std::int64_t sweeps = 0;       ///< of the implicit iteration
};

struct Options {
  double rtol = 1e-12, atol = 1e-14;  ///< of methods that work to a tolerance
  int max_sweeps = 100;               ///< of implicit iterations
  bool lanes = true;  ///< evaluate Gauss stages as SIMD lanes (same bits as scalar stages)
};

/// A method at work on one system with one step size. One object per thread. step() allocates nothing.
class Integrator {
 public:
  virtual ~Integrator() = default;
  virtual const Declaration& declaration() const = 0;
  virtual double step_size() const = 0;

  /// Advances the state by one step h. On any outcome but `ok` the state is unchanged.
  [[nodiscard]] virtual Outcome step(phs::State& state) = 0;

  /// What the next step depends on besides the state (start values of the iteration), for checkpoints.
  virtual std::vector<double> memory() const { return {}; }
  /// Puts memory() back. @throws InvalidArgument if the size does not fit.
  virtual void restore(std::span<const double> memory) {
    require_size("integrator memory", memory.size(), 0);
  }

  const Cost& cost() const { return cost_; }
  void set_cost(const Cost& c) { cost_ = c; }

 protected:
  Cost cost_;
};

/// All methods, in the order of docs and `porthos methods`.
const std::vector<Declaration>& catalogue();

/// A method by its catalogue name on a system, step h [s]. The model must outlive it.
/// @throws InvalidArgument for an unknown name (lists the known ones), a step that is zero or not finite, or a system
///   the method cannot take (a partitioned method needs a canonical one)
std::unique_ptr<Integrator> make_integrator(const std::string& method, const phs::Model& model,
                                            double h, const Options& options = {});

}  // namespace porthos::integrators
