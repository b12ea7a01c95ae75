#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "phs/error.h"
#include "phs/functions/law.h"
#include "phs/scalars/scalar.h"
#include "phs/system/constraints.h"
#include "phs/system/description.h"
#include "phs/system/resolvent.h"

/// The port-Hamiltonian contract
///
///   x' = (J(x) - R(x)) e + G(x) u,    y = G(x)ᵀ e,    e = ∂H/∂x(x)
///   H' = yᵀu - eᵀR e
///
/// with J = -Jᵀ and R = Rᵀ >= 0, so the balance holds by structure.
namespace porthos::phs {

/// One system evaluated in the scalar T: an immutable model with its own workspace. Use one object
/// per thread; `clone` makes another. Each whole evaluation is one virtual call, static inside. No
/// evaluation allocates.
///
/// Sizes: x, e, dx have nx numbers, u and y have nu, invariants have
/// description().invariant_count(). An empty u means u = 0.
template <class T>
class System {
 public:
  virtual ~System() = default;
  virtual const Description& description() const = 0;
  virtual std::unique_ptr<System> clone() const = 0;

  /// H(x) [J].
  virtual T hamiltonian(std::span<const T> x) = 0;
  /// e = ∂H/∂x.
  virtual void gradient(std::span<const T> x, std::span<T> e) = 0;
  /// dx = (J - R) e + G u at time t, plus the system's own sources.
  virtual void field(T t, std::span<const T> x, std::span<const T> u, std::span<T> dx) = 0;
  /// The same with given efforts e instead of ∂H/∂x(x), as discrete gradients need it. A nonlinear
  /// resistive law is evaluated at these efforts.
  virtual void rate(T t, std::span<const T> x, std::span<const T> e, std::span<T> dx) = 0;
  /// e = ∂H/∂x(x), given dx = field(t, x, {}): read from dx if J allows it, else by gradient().
  virtual void efforts(T t, std::span<const T> x, std::span<const T> dx, std::span<T> e) {
    (void)t;
    (void)dx;
    gradient(x, e);
  }
  /// Je = J(x) e, for any e.
  virtual void apply_structure(std::span<const T> x, std::span<const T> e, std::span<T> Je) = 0;
  /// Re = R(x) e, for any e. Zero for a lossless system.
  virtual void apply_dissipation(std::span<const T> x, std::span<const T> e, std::span<T> Re) = 0;
  /// Gu = G(x) u.
  virtual void apply_input(std::span<const T> x, std::span<const T> u, std::span<T> Gu) = 0;
  /// y = G(x)ᵀ e.
  virtual void output(std::span<const T> x, std::span<const T> e, std::span<T> y) = 0;
  /// The energy in each of description().storages [J].
  virtual void stored(std::span<const T> x, std::span<T> values) { values[0] = hamiltonian(x); }
  /// Each of description().powers at the efforts e [W].
  virtual void powers(T t, std::span<const T> x, std::span<const T> e, std::span<T> values) {
    (void)t;
    (void)x;
    (void)e;
    (void)values;
  }
  /// The declared invariants, one after another.
  virtual void invariants(std::span<const T> x, std::span<T> values) = 0;
  /// Moves x by the exact flow of part k of H (Description::flows) over h from time t, without
  /// damping and inputs.
  virtual void flow(int k, T t, T h, std::span<T> x) {
    (void)t;
    (void)h;
    (void)x;
    throw InvalidArgument("system '" + description().name + "' has no partial flow " +
                          std::to_string(k));
  }
  /// Sets 2π·turns of each angle block, in block order, for terms that are not 2π-periodic.
  /// Integrators call it after a wrap.
  virtual void set_turn_angles(std::span<const T>) {}
  /// From now on, reads the values of the sampled controllers from `memories`, one for each of
  /// Model::holds(). Before the first call, the values before their first instant hold.
  virtual void use_held(std::span<const HeldPtr> memories) { (void)memories; }
  /// Advances hold number i of Model::holds() to the sampling instant t: updates `memory` from the
  /// last instant to this one.
  virtual void sample(std::size_t i, T t, std::span<const T> x, std::span<double> memory) {
    (void)i;
    (void)t;
    (void)x;
    (void)memory;
  }
  /// An evaluator of the system's constraints, or nullptr if it has none. It knows the turn angles
  /// of this object at the time and must not outlive it.
  virtual std::unique_ptr<Constraints<T>> constraints() { return nullptr; }
  /// The system's own solver of (I - z J) d = r for Newton iterations, or nullptr if it has none.
  /// It reads the turn angles of this object and must not outlive it.
  virtual std::unique_ptr<Resolvent> resolvent() { return nullptr; }
};

/// A system before a scalar is chosen: immutable, shared between threads.
class Model {
 public:
  virtual ~Model() = default;
  virtual const Description& description() const = 0;
  /// The sampled controllers in it; empty: none. The values they hold belong to a run, not to the
  /// model.
  virtual std::vector<HoldPtr> holds() const { return {}; }

  /// The evaluator for scalar T. It refers to this model, which must outlive it.
  template <class T>
  std::unique_ptr<System<T>> instantiate() const {
    std::unique_ptr<System<T>> s;
    make(s);
    return s;
  }

 protected:
  virtual void make(std::unique_ptr<System<double>>&) const = 0;
  virtual void make(std::unique_ptr<System<long double>>&) const = 0;
  virtual void make(std::unique_ptr<System<Quad>>&) const = 0;
  virtual void make(std::unique_ptr<System<Dual>>&) const = 0;
  virtual void make(std::unique_ptr<System<Pack4>>&) const = 0;
  virtual void make(std::unique_ptr<System<Pack8>>&) const = 0;
};

/// Implements Model's six `make` overloads by one template. Derived has
///   template <class T> std::unique_ptr<System<T>> make_system() const;
template <class Derived>
class ModelFor : public Model {
 protected:
#define PORTHOS_MAKE(T)                                               \
  void make(std::unique_ptr<System<T>>& s) const override {           \
    s = static_cast<const Derived*>(this)->template make_system<T>(); \
  }
  PORTHOS_FOR_EACH_SCALAR(PORTHOS_MAKE)
#undef PORTHOS_MAKE
};

}  // namespace porthos::phs
