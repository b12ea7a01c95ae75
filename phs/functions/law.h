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

/// A number of a law that derivatives of runs are there for.
struct LawGain {
  std::string name;
  double value;
  std::string unit = "1";
};

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
  /// Why the law is not meant for the state x, and what to do; a run that fails there says it.
  /// Empty: it is meant for x.
  virtual std::string hindrance(std::span<const double> x) const {
    (void)x;
    return {};
  }
};
using LawPtr = std::shared_ptr<const Law>;

/// A second base class of a law whose numbers runs have derivatives by.
class WithGains {
 public:
  virtual ~WithGains() = default;
  virtual std::vector<LawGain> gains() const = 0;
  /// The law in duals, with these gains in place of its own.
  virtual void with_gains(std::span<const Dual> gains, const Dual& t, std::span<const Dual> x,
                          std::span<const Dual> y, std::span<Dual> u) const = 0;
};

/// A second base class of a law that keeps a limit of its own.
class WithLimit {
 public:
  virtual ~WithLimit() = default;
  virtual double limit() const = 0;  ///< |u| at most, at a port of one number
};

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

/// One with gains that runs have derivatives by, at most 8: f(gains, t, x, y, u), `gains` a span
/// of numbers like those of x.
/// @throws InvalidArgument for more of them
template <class F>
LawPtr law(std::vector<LawGain> gains, F f) {
  constexpr size_t most = 8;
  class Callable final : public Law, public WithGains {
   public:
    Callable(std::vector<LawGain> own, F law) : gains_(std::move(own)), f_(std::move(law)) {
      if (gains_.size() > most)
        throw InvalidArgument("a law has " + std::to_string(gains_.size()) +
                              " gains, expected at most " + std::to_string(most));
    }
#define PORTHOS_EVALUATE(T)                                                                 \
  void operator()(const T& t, std::span<const T> x, std::span<const T> y, std::span<T> u)   \
      const override {                                                                      \
    T values[most];                                                                         \
    for (size_t k = 0; k < gains_.size(); ++k) values[k] = static_cast<T>(gains_[k].value); \
    f_(std::span<const T>(values, gains_.size()), t, x, y, u);                              \
  }
    PORTHOS_FOR_EACH_SCALAR(PORTHOS_EVALUATE)
#undef PORTHOS_EVALUATE
    std::vector<LawGain> gains() const override { return gains_; }
    void with_gains(std::span<const Dual> values, const Dual& t, std::span<const Dual> x,
                    std::span<const Dual> y, std::span<Dual> u) const override {
      f_(values, t, x, y, u);
    }

   private:
    std::vector<LawGain> gains_;
    F f_;
  };
  return std::make_shared<Callable>(std::move(gains), std::move(f));
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
  /// @param y  outputs of the controller's ports, in turn; then the energy in the tank that pays
  ///   for it, if one does [J]
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

/// One that runs have derivatives of.
class SmoothSampledLaw : public SampledLaw {
 public:
  /// Its numbers that runs have derivatives by; empty: none.
  virtual std::vector<LawGain> gains() const { return {}; }
  /// The law in duals, with these gains in place of its own.
  virtual void in_duals(std::span<const Dual> gains, const Dual& t, std::span<const Dual> x,
                        std::span<const Dual> y, std::span<Dual> memory,
                        std::span<Dual> u) const = 0;
};

/// A generic callable as a SmoothSampledLaw: f(gains, t, x, y, memory, u) in double and in duals.
template <class F>
SampledLawPtr sampled_law(std::vector<double> fresh, std::vector<LawGain> gains, F f) {
  class Callable final : public SmoothSampledLaw {
   public:
    Callable(std::vector<double> own, std::vector<LawGain> gains_of, F law)
        : fresh_(std::move(own)), gains_(std::move(gains_of)), f_(std::move(law)) {
      for (const auto& gain : gains_) values_.push_back(gain.value);
    }
    std::vector<double> fresh() const override { return fresh_; }
    void operator()(double t, std::span<const double> x, std::span<const double> y,
                    std::span<double> memory, std::span<double> u) const override {
      f_(std::span<const double>(values_), t, x, y, memory, u);
    }
    std::vector<LawGain> gains() const override { return gains_; }
    void in_duals(std::span<const Dual> values, const Dual& t, std::span<const Dual> x,
                  std::span<const Dual> y, std::span<Dual> memory,
                  std::span<Dual> u) const override {
      f_(values, t, x, y, memory, u);
    }

   private:
    std::vector<double> fresh_, values_;
    std::vector<LawGain> gains_;
    F f_;
  };
  return std::make_shared<Callable>(std::move(fresh), std::move(gains), std::move(f));
}

/// The zero-order hold of a sampled controller, as part of a model. Its memory belongs to a run:
/// the held values, then whatever the controller remembers of the last instant. The integrator of
/// that run owns and updates it (integrators/core/sampler.h); the evaluators of the run read it.
struct Hold {
  std::string name;
  double period;                  ///< [s]
  std::vector<double> fresh;      ///< memory before the first instant
  std::vector<Shown> shown = {};  ///< numbers of that memory by name
  size_t values = 0;              ///< how many of the first are the held ones
};
/// The memory of one hold, shared between the evaluators of a run.
using HeldPtr = std::shared_ptr<const std::vector<double>>;
using HoldPtr = std::shared_ptr<Hold>;

}  // namespace porthos::phs
