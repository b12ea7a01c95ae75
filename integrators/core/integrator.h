#pragma once
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "integrators/core/port_work.h"
#include "integrators/core/sampler.h"
#include "integrators/core/turns.h"
#include "phs/system/archive.h"
#include "phs/system/state.h"
#include "phs/system/system.h"

/// Time integrators. They depend on the system contract of phs/ and not on mechanics.
namespace porthos::integrators {

/// The number type of the tables for steps in T.
template <class T>
using TableReal = std::conditional_t<std::is_same_v<T, phs::Quad>, phs::Quad, double>;

/// A step size or a fraction of a step as a number for the tables.
template <class T>
TableReal<T> table_real(const T& x) {
  if constexpr (std::is_same_v<T, phs::Dual>)
    return x.v;
  else
    return x;
}

/// A method's claim about a property. The test suite checks every `holds` and, with a negative
/// control, every `fails`.
enum class Claim { holds, fails, unknown };
const char* to_string(Claim c);

/// What a method requires of a system, beyond a field to evaluate.
struct Needs {
  bool canonical = false;     ///< x = (q, p), J = [0 I; -I 0]
  bool lossless = false;      ///< R = 0
  bool separable = false;     ///< H = T(p) + V(q)
  bool linear_state = false;  ///< no quaternion blocks
  bool flows = false;         ///< partial flows (Description::flows), or a separable H
  bool contacts = false;      ///< rigid contacts or stops, whose jumps the method makes itself
};

/// The properties of a method, for lossless systems unless stated otherwise.
struct Declaration {
  std::string name = {};           ///< "gauss16": the name in scenes
  std::string title = {};          ///< one line for readers
  std::string family = {};         ///< heading in the docs
  int order = 0;                   ///< 0: set by a tolerance
  Claim symmetric = Claim::fails;  ///< step(h) then step(-h) is the identity
  Claim symplectic = Claim::fails;
  Claim energy_exact = Claim::fails;  ///< H conserved to rounding for any H
  Claim passivity_exact =
      Claim::fails;  ///< the discrete power balance closes to rounding for any H
  Claim quadratic_invariants = Claim::fails;  ///< linear and quadratic ones conserved to rounding
  /// Keeps a system's constraints, positions and rates, to rounding. If not, the method refuses
  /// constrained systems; if so, it takes systems without constraints too. Of a rival: it takes
  /// constrained systems alone, and may leave the manifold.
  bool constraints = false;
  bool rolling = false;   ///< and rows that restrict rates alone
  bool resumable = true;  ///< a run can be continued bit for bit from a checkpoint
  bool rival = false;     ///< another library's method, for comparison
  Needs needs = {};
  std::string source = {};
};

/// How a step ended. Any outcome but `ok` leaves the state unchanged.
/// singular: the constraints lose rank (BasicIntegrator::remark has more).
enum class Outcome { ok, not_converged, not_finite, failed, singular, jammed };
const char* to_string(Outcome o);

/// The cost of a run since the integrator was made.
struct Cost {
  std::int64_t steps = 0;
  std::int64_t evaluations = 0;     ///< of the field (or its parts) for one state
  std::int64_t sweeps = 0;          ///< of the implicit iteration
  std::int64_t factorisations = 0;  ///< of a Newton matrix
};

/// How an implicit method solves its equations. automatic: fixed-point iteration while it
/// contracts, else Newton with the cheapest solver that converges: the system's own O(n)
/// elimination, else dense up to 100 state numbers, else Krylov.
enum class Solver { automatic, fixed_point, newton_articulated, newton_dense, newton_krylov };
const char* to_string(Solver s);

/// A jump inside a step: an impact, or a joint that breaks away.
struct Jump {
  double t;      ///< [s]
  size_t power;  ///< of the system's powers, the one that has its loss, or counts it
  double loss;   ///< [J]
};

/// Options besides method and step. Each method uses those that apply to it.
struct Options {
  double rtol = 1e-12, atol = 1e-14;  ///< of tolerance-controlled methods
  int max_sweeps = 100;               ///< of implicit iterations
  Solver solver = Solver::automatic;  ///< of implicit methods with a choice
  bool lanes = true;      ///< evaluate stages as SIMD lanes (same bits as scalar stages)
  bool port_work = true;  ///< integrate the powers of each step; off: port_work() is empty
  bool wrap = true;       ///< keep angles in [-π, π]; off only as a negative control
  double binding = 0;     ///< ω of Tao's methods [1/s]; 0: their own choice
  /// 0: iterate to stagnation. Otherwise stop when no sweep moves a stage by more than this,
  /// relative. The remaining error is biased, so the energy drifts slowly. For tolerances far above
  /// rounding this halves the work; smaller ones serve as a control. Of "moreau": the residual of
  /// the impulses, 1e-10 or more.
  double iteration_tolerance = 0;
  /// Ascending times at which the system jumps [s]; they are ends of steps. There a method restarts
  /// what it carries from step to step (a library's history, the variable of a step control).
  std::vector<double> instants = {};
};

/// A method applied to one system with one step size. One object per thread. step() allocates
/// nothing. T = double for runs; Dual gives the exact Jacobian of a step, Quad a 113-bit run of the
/// same method.
template <class T>
class BasicIntegrator {
 public:
  using State = phs::BasicState<T>;
  virtual ~BasicIntegrator() = default;
  const Declaration& declaration() const { return declaration_; }
  T step_size() const { return h_; }

  /// Advances the state by one step h. On any outcome but `ok` the state is unchanged, and the
  /// method continues from it as from a new state.
  [[nodiscard]] virtual Outcome step(State& state);
  /// One step of another size, to an event or to the end of a run; the clock's origin moves to its
  /// end. Sampled controllers hold through the next step. Whole steps from there would miss their
  /// instants and throw InvalidArgument, unless the clock returns to whole steps
  /// (EventOptions::to_grid).
  [[nodiscard]] virtual Outcome step_by(State& state, T h);
  /// The time of a state that step() produced [s].
  virtual T time(const State& state) const { return state.time(h_); }

  /// The bare map: x + lo moves by one step h from time t, without clock and wrapping. The state is
  /// unchanged unless `ok`.
  [[nodiscard]] virtual Outcome advance(T t, T h, State& state) = 0;
  /// advance() with turn counts and port work.
  [[nodiscard]] Outcome advance_with_port_work(T t, T h, State& state);
  /// Passes the turn counts of the state to the systems in use.
  virtual void tell_turns(const State& state) { turns_.synchronise(state, *system_); }

  /// Dense output inside the last step: x at the fraction theta in [0, 1] of it, given the state
  /// `after` it, with angles on the branch of that state. Returns false if the method has none.
  /// Never continue a run from this x; use step_by().
  virtual bool interpolate(const State& after, T theta, std::span<T> x) const {
    (void)after;
    (void)theta;
    (void)x;
    return false;
  }

  /// What the next step depends on besides the state (start values of the iteration). For
  /// checkpoints and for going back.
  std::vector<double> memory() const {
    std::vector<double> m;
    save(m);
    return m;
  }
  /// Appends it to m; allocates only if the capacity of m is too small.
  void save(std::vector<double>& m) const { save_carried(*this, m); }
  /// Puts memory() back. @throws InvalidArgument if the size does not fit.
  void restore(std::span<const double> memory) { load_carried(*this, memory, "integrator memory"); }
  /// The numbers of memory(), for an archive.
  virtual void carry(Archive& archive) { (void)archive; }
  /// Takes ownership of the model of its run.
  void keep_model(std::shared_ptr<const phs::Model> model) { kept_ = std::move(model); }
  const std::shared_ptr<const phs::Model>& kept_model() const { return kept_; }
  /// Updates the outputs of sampled controllers; it has its own memory for checkpoints.
  Sampler<T>& sampler() { return sampler_; }
  /// The method's remark on its run, for reports ("Newton, dense"). Empty: nothing unusual.
  virtual std::string remark() const { return {}; }

  /// Energy through each of the system's powers (Description::powers) in the last step [J].
  virtual std::span<const T> port_work() const { return port_work_.of_step(); }
  /// Whether the powers are integrated with the method's own weights. Then the energy balance is as
  /// exact as the method. Otherwise two Gauss points inside the step are used (order 4).
  virtual bool integrates_power() const { return false; }
  /// Whether each step evaluates a force that jumps at the ends of steps from its inside.
  virtual bool sees_inside() const { return integrates_power(); }

  /// Jumps of the state in the last step, in order.
  virtual std::span<const Jump> jumps() const { return {}; }

  /// Whether the method chooses its own step sizes instead of step_size().
  virtual bool varies() const { return false; }
  virtual Cost cost() const { return cost_; }
  virtual void set_cost(const Cost& c) { cost_ = c; }

 protected:
  BasicIntegrator(Declaration d, const phs::Model& model, T h, const Options& o)
      : declaration_(std::move(d)),
        h_(h),
        options_(o),
        system_(model.instantiate<T>()),
        turns_(model.description()),
        port_work_(model.description(), o.port_work),
        sampler_(model, phs::to_double(h)),
        n_(size_t(model.description().nx)) {}

  /// step_by() without renewing the sampled controllers.
  [[nodiscard]] Outcome step_off_the_grid(State& state, T h);
  /// Undoes the samplers' renewal for a step that failed.
  Outcome taken_back_unless_ok(Outcome o) {
    if (o != Outcome::ok) sampler_.take_back();
    return o;
  }

  std::shared_ptr<const phs::Model> kept_;  ///< first: systems refer to it
  Declaration declaration_;
  T h_;
  Options options_;
  std::unique_ptr<phs::System<T>> system_;
  TurnKeeper<T> turns_;
  PortWork<T> port_work_;
  Sampler<T> sampler_;
  size_t n_;  ///< numbers in the state
  Cost cost_;
};
using Integrator = BasicIntegrator<double>;

/// The scalars a method is instantiated for.
#define PORTHOS_FOR_EACH_STEP_SCALAR(X) X(double) X(porthos::phs::Dual) X(porthos::phs::Quad)

/// All methods, in the order of the docs and of `porthos methods`.
const std::deque<Declaration>& catalogue();
/// The declaration of a method. @throws InvalidArgument for an unknown name, which lists the known
/// ones
const Declaration& declaration_of(const std::string& method);

/// Why a method cannot integrate a system, or nothing if it can.
std::optional<std::string> misfit(const Declaration& method, const phs::Description& system);

/// A method by its catalogue name, for a system and step h [s]. The model must outlive it. T =
/// double, Dual or Quad.
/// @throws InvalidArgument for an unknown name (lists the known ones), a step that is zero or not
///   finite, a system or scalar that the method does not support (misfit; rivals work in double),
///   or a sampled controller whose period is not a whole number of steps
template <class T>
std::unique_ptr<BasicIntegrator<T>> make_basic_integrator(const std::string& method,
                                                          const phs::Model& model, T h,
                                                          const Options& options = {});
inline std::unique_ptr<Integrator> make_integrator(const std::string& method,
                                                   const phs::Model& model, double h,
                                                   const Options& options = {}) {
  return make_basic_integrator<double>(method, model, h, options);
}

#define PORTHOS_EXTERN(T) extern template class BasicIntegrator<T>;
PORTHOS_FOR_EACH_STEP_SCALAR(PORTHOS_EXTERN)
#undef PORTHOS_EXTERN

}  // namespace porthos::integrators
