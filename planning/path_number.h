#pragma once
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "phs/scalars/derivative.h"
#include "planning/dynamics.h"

namespace porthos::planning {

/// A number c(t, x) of the state that a plan keeps between limits or brings to a goal, such as a
/// distance, with its derivatives by x. One object per thread.
class PathNumber {
 public:
  using In = std::span<const double>;
  using Out = std::span<double>;

  virtual ~PathNumber() = default;
  /// c(t, x). t [s]; x: size nx
  virtual double value(double t, In x) = 0;
  /// ∂c/∂x, size nx; exact: it decides where the solver converges to.
  virtual void gradient(double t, In x, Out g) = 0;
  /// ∇²c, symmetric, nx × nx numbers. Unless overridden it takes central differences of the
  /// gradient: it only decides how fast the solver converges.
  virtual void hessian(double t, In x, Out H);
};

/// A number given by a function c(t, x) for every scalar, with derivatives by duals:
/// path_number(2, [](double t, auto x) { return x[0] * x[1]; }). x is a span.
template <class F>
std::shared_ptr<PathNumber> path_number(int nx, F f) {
  using D = phs::Dual;
  class OfFunction final : public PathNumber {
   public:
    OfFunction(int nx, F f) : f_(std::move(f)), d_(size_t(nx)) {}
    double value(double t, In x) override { return f_(t, x); }
    void gradient(double t, In x, Out g) override {
      for (size_t k = 0; k < d_.size(); ++k) d_[k] = D(x[k]);
      phs::along_each(d_, [&](size_t k) { g[k] = f_(t, std::span<const D>(d_)).d; });
    }

   private:
    F f_;
    std::vector<D> d_;
  };
  return std::make_shared<OfFunction>(nx, std::move(f));
}

/// dc/dt along x' = f(t, x, u = 0) of a number whose rate no input changes at once, such as a
/// distance. Its gradient has the rate of ∇c by differences of the fourth order, with errors of
/// about 1e-12 of its size.
/// @param dynamics  of the plan, used by one solver at a time
/// @throws InvalidArgument for null pointers
std::shared_ptr<PathNumber> rate_of(std::shared_ptr<PathNumber> number,
                                    std::shared_ptr<Dynamics> dynamics);

/// Limits of a number; -inf and inf where there is none.
struct PathLimit {
  std::shared_ptr<PathNumber> number;  ///< used by one solver at a time
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

}  // namespace porthos::planning
