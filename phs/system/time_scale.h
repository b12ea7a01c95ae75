#pragma once
#include <memory>
#include <utility>
#include <vector>

#include "phs/scalars/derivative.h"
#include "phs/system/system.h"
#include "phs/system/user_model.h"

/// State-dependent step sizes: sigma(x) > 0, the rate of physical time against fictitious time.
namespace porthos::phs {

/// sigma in the scalar T, a rate [1]. Callers pass e = ∂H/∂x(x) with x, of size nx each.
template <class T>
class TimeScale {
 public:
  virtual ~TimeScale() = default;
  /// sigma(x) > 0.
  virtual T value(std::span<const T> x, std::span<const T> e) = 0;
  /// Returns sigma and writes ∂sigma/∂x (size nx).
  virtual T with_gradient(std::span<const T> x, std::span<const T> e, std::span<T> gradient) = 0;
  /// See System::set_turn_angles.
  virtual void set_turn_angles(std::span<const T>) {}
};

/// A time scale before a scalar is chosen: immutable, shared between threads.
class TimeScaleModel {
 public:
  virtual ~TimeScaleModel() = default;
  template <class T>
  std::unique_ptr<TimeScale<T>> instantiate() const {
    std::unique_ptr<TimeScale<T>> s;
    make(s);
    return s;
  }

 protected:
#define PORTHOS_MAKE(T) virtual void make(std::unique_ptr<TimeScale<T>>&) const = 0;
  PORTHOS_FOR_EACH_SCALAR(PORTHOS_MAKE)
#undef PORTHOS_MAKE
};

/// Implements the `make` overloads by one template, as ModelFor does.
template <class Derived>
class TimeScaleFor : public TimeScaleModel {
 protected:
#define PORTHOS_MAKE(T)                                              \
  void make(std::unique_ptr<TimeScale<T>>& s) const override {       \
    s = static_cast<const Derived*>(this)->template make_scale<T>(); \
  }
  PORTHOS_FOR_EACH_SCALAR(PORTHOS_MAKE)
#undef PORTHOS_MAKE
};

/// A user's plain class S as a time scale. It needs
///
///   template <class T> T value(std::span<const T> x) const;
///
/// and may have  template <class T> void gradient(std::span<const T> x, std::span<T> g) const;
/// Otherwise duals give the gradient, with one evaluation per coordinate, in double and lanes only.
template <class S>
class UserTimeScale : public TimeScaleFor<UserTimeScale<S>> {
 public:
  explicit UserTimeScale(S scale) : scale_(std::move(scale)) {}

  template <class T>
  class Evaluator : public TimeScale<T> {
   public:
    explicit Evaluator(const S& s) : s_(s) {}
    T value(std::span<const T> x, std::span<const T>) override { return s_.value(x); }
    T with_gradient(std::span<const T> x, std::span<const T>, std::span<T> g) override {
      if constexpr (HasGradient<S, T>) {
        s_.gradient(x, g);
      } else if constexpr (has_gradient_by_duals<T>) {
        dual_.resize(x.size());  // allocates once
        gradient_by_duals<T>([&](auto y) { return s_.value(y); }, x, dual_, g);
      } else {
        throw InvalidArgument(
            "this time scale has no gradient(x, g): duals give it in double and lanes only");
      }
      return s_.value(x);
    }

   private:
    const S& s_;
    std::vector<Dual> dual_;
  };

  template <class T>
  std::unique_ptr<TimeScale<T>> make_scale() const {
    return std::make_unique<Evaluator<T>>(scale_);
  }

 private:
  S scale_;
};

/// A time scale from the speed of the coordinates that have a momentum, measured as a rate:
///
///   sigma = 1 / sqrt(1 + w²/rate²),
///   w² = Σ_angles φ'² + Σ_rotations |ω|² + Σ_linear q'² / length²
///
/// It lies between 0 and 1, is even in p (time-reversible), and costs O(n). Its gradient is
/// -sigma³/rate² D²H·(0, W q'): two gradients of H if H is declared quadratic in its momenta, in
/// any scalar; otherwise one in duals per state, in double and lanes only. Linear
/// coordinates count only if a length is given. Coordinates without a momentum (a motor's current)
/// do not count.
class RateTimeScale : public TimeScaleFor<RateTimeScale> {
 public:
  /// rate [rad/s], length [m] (0: linear coordinates do not count). The model must outlive this
  /// object.
  /// @throws InvalidArgument if a number is not finite, rate <= 0, length < 0, no coordinate
  /// counts, or the model is falsely declared quadratic in its momenta
  RateTimeScale(const Model& model, double rate, double length = 0);

  const Model& model() const { return model_; }
  double rate() const { return rate_; }
  /// A rate q' = ∂H/∂p: the offset of its p in x, and the factor of q'² in w².
  struct Rate {
    size_t momentum;
    double weight;
  };
  const std::vector<Rate>& rates() const { return rates_; }

  template <class T>
  std::unique_ptr<TimeScale<T>> make_scale() const;

 private:
  const Model& model_;
  double rate_;
  std::vector<Rate> rates_;
};

}  // namespace porthos::phs
