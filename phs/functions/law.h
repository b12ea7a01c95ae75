#pragma once
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "phs/error.h"
#include "phs/scalars/scalar.h"

/// Laws of controllers, continuous or sampled.
namespace porthos::phs {

/// u = κ(t, x, y). x: state of the controlled system, with its angles unwrapped. y: output of the
/// port, then those of the sensors. u: input at the port. Immutable, shared between threads.
class Law {
 public:
  virtual ~Law() = default;
#define PORTHOS_EVALUATE(T)                                                                       \
  virtual void operator()(const T& t, std::span<const T> x, std::span<const T> y, std::span<T> u) \
      const = 0;
  PORTHOS_FOR_EACH_SCALAR(PORTHOS_EVALUATE)
#undef PORTHOS_EVALUATE
  /// Why it is not meant for a state, and what to do: it may have ended a run that failed there.
  /// Empty: it is meant for it.
  virtual std::string hindrance(std::span<const double> x) const {
    (void)x;
    return {};
  }
};
using LawPtr = std::shared_ptr<const Law>;

/// The hindrance of a law that is meant for every state: none.
inline std::string no_hindrance(std::span<const double>) { return {}; }

/// A generic callable as a Law: law([](auto t, auto x, auto y, auto u) { u[0] = -2.0 * x[0] - 0.3 *
/// y[0]; }). hindrance: as Law's, a function of x.
template <class F, class Hindrance>
LawPtr law(F f, Hindrance hindrance) {
  class Callable final : public Law {
   public:
    Callable(F own, Hindrance told) : f_(std::move(own)), hindrance_(std::move(told)) {}
#define PORTHOS_EVALUATE(T)                                                               \
  void operator()(const T& t, std::span<const T> x, std::span<const T> y, std::span<T> u) \
      const override {                                                                    \
    f_(t, x, y, u);                                                                       \
  }
    PORTHOS_FOR_EACH_SCALAR(PORTHOS_EVALUATE)
#undef PORTHOS_EVALUATE
    std::string hindrance(std::span<const double> x) const override { return hindrance_(x); }

   private:
    F f_;
    Hindrance hindrance_;
  };
  return std::make_shared<Callable>(std::move(f), std::move(hindrance));
}
/// One that is meant for every state.
template <class F>
LawPtr law(F f) {
  return law(std::move(f), no_hindrance);
}

/// Numbers in the memory of a sampled controller that outputs of a run may show.
struct Shown {
  std::string name;
  size_t at, size;  ///< their place in the memory, and how many
};

/// A law that failed at an instant: the run ends.
struct LawFailure : InvalidArgument {
  using InvalidArgument::InvalidArgument;
};

/// What a controller with a memory computes at its sampling instants: u = κ(t, x, y, memory). The
/// memory belongs to a run, so the law is the same function of it in a run and in its repetition.
class SampledLaw {
 public:
  virtual ~SampledLaw() = default;
  /// The memory before the first instant; it keeps its size.
  virtual std::vector<double> fresh() const = 0;
  /// @param x  state of the controlled system, with its angles unwrapped
  /// @param y  outputs of the controller's ports, in turn
  /// @param u  held at these ports until the next instant
  virtual void operator()(double t, std::span<const double> x, std::span<const double> y,
                          std::span<double> memory, std::span<double> u) const = 0;
  /// Numbers of its memory that users may see.
  virtual std::vector<Shown> shown() const { return {}; }
  /// What its memory tells at the end of a run, a sentence each.
  virtual std::vector<std::string> stories(std::span<const double> memory) const {
    (void)memory;
    return {};
  }
};
using SampledLawPtr = std::shared_ptr<const SampledLaw>;

/// The zero-order hold of a sampled controller, as part of a model. Its memory belongs to a run:
/// the held values, then whatever the controller remembers of the last instant. The integrator of
/// that run owns and updates it (integrators/core/sampler.h); the evaluators of the run read it.
struct Hold {
  std::string name;
  double period;                  ///< [s]
  std::vector<double> fresh;      ///< memory before the first instant
  std::vector<Shown> shown = {};  ///< numbers of that memory by name
};
/// The memory of one hold, shared between the evaluators of a run.
using HeldPtr = std::shared_ptr<const std::vector<double>>;
using HoldPtr = std::shared_ptr<Hold>;

}  // namespace porthos::phs
