#include "planning/path_number.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "phs/error.h"

namespace porthos::planning {
namespace {

class RateOf final : public PathNumber {
 public:
  RateOf(std::shared_ptr<PathNumber> number, std::shared_ptr<Dynamics> dynamics)
      : number_(std::move(number)),
        dynamics_(std::move(dynamics)),
        n_(size_t(dynamics_->nx())),
        none_(size_t(dynamics_->nu()), 0.0),
        f_(n_),
        g_(n_),
        at_(n_),
        J_(n_ * (n_ + none_.size())) {}

  double value(double t, In x) override {
    dynamics_->field({&t, 1}, x, none_, f_);
    number_->gradient(t, x, g_);
    double sum = 0;
    for (const auto& [steps, weight] : stencil)
      sum += weight / time * number_->value(t + steps * time, x);
    for (size_t k = 0; k < n_; ++k) sum += g_[k] * f_[k];
    return sum;
  }
  void gradient(double t, In x, Out g) override {
    dynamics_->jacobian({&t, 1}, x, none_, f_, J_);
    number_->gradient(t, x, g_);
    for (size_t k = 0; k < n_; ++k) {
      g[k] = 0;
      for (size_t i = 0; i < n_; ++i) g[k] += g_[i] * J_[k * n_ + i];
    }
    double size = 1;
    for (const double each : f_) size = std::max(size, std::fabs(each));
    const double h = time / size;
    for (const auto& [steps, weight] : stencil) {
      for (size_t k = 0; k < n_; ++k) at_[k] = x[k] + steps * h * f_[k];
      number_->gradient(t + steps * h, at_, g_);
      for (size_t k = 0; k < n_; ++k) g[k] += weight / h * g_[k];
    }
  }

 private:
  static constexpr double time = 1e-3;  ///< of a difference [s]
  static constexpr std::pair<double, double> stencil[] = {
      {1, 8. / 12}, {-1, -8. / 12}, {2, -1. / 12}, {-2, 1. / 12}};
  std::shared_ptr<PathNumber> number_;
  std::shared_ptr<Dynamics> dynamics_;
  size_t n_;
  std::vector<double> none_, f_, g_, at_, J_;
};

}  // namespace

std::shared_ptr<PathNumber> rate_of(std::shared_ptr<PathNumber> number,
                                    std::shared_ptr<Dynamics> dynamics) {
  if (!number || !dynamics)
    throw InvalidArgument("the rate of a number needs the number and the dynamics, one is null");
  return std::make_shared<RateOf>(std::move(number), std::move(dynamics));
}

void PathNumber::hessian(double t, In x, Out H) {
  const size_t n = x.size();
  std::vector<double> at(x.begin(), x.end()), after(n), before(n);
  for (size_t k = 0; k < n; ++k) {
    const double step = 1e-5 * (1 + std::fabs(x[k]));  // the error is about 1e-10 of the size
    at[k] = x[k] + step;
    gradient(t, at, after);
    at[k] = x[k] - step;
    gradient(t, at, before);
    at[k] = x[k];
    for (size_t i = 0; i < n; ++i) H[k * n + i] = (after[i] - before[i]) / (2 * step);
  }
  for (size_t k = 0; k < n; ++k)
    for (size_t i = 0; i < k; ++i) H[k * n + i] = H[i * n + k] = (H[k * n + i] + H[i * n + k]) / 2;
}

}  // namespace porthos::planning
