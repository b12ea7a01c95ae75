#include "planning/detail/approach.h"

#include <cmath>

namespace porthos::planning::detail {
namespace {

/// The goals are near at this part of their first distance.
constexpr double near = 1e-2;
constexpr int rounds = 12, steps_of_a_round = 30;

class Approach {
 public:
  Approach(Shooting& shooting, Vector& v, const PlannerOptions& o)
      : o_(o), shooting_(shooting), v_(v), nu_(Vector::Zero(shooting_.goals.size())) {}

  int run() {
    if (!shooting_.roll(v_)) return -1;
    double before = shooting_.goals.norm();
    const double enough = near * before;
    rho_ = 20 * (1 + shooting_.cost) / (1e-12 + before * before);
    int iterations = 0;
    for (int round = 0; round < rounds && before > enough; ++round) {
      exact_ = o_.exact_hessian;
      for (int i = 0; i < steps_of_a_round; ++i, ++iterations)
        if (!improve()) break;
      const double now = shooting_.goals.norm();
      nu_ += rho_ * shooting_.goals;
      if (now > 0.2 * before) rho_ *= 10;
      before = now;
    }
    return iterations;
  }

 private:
  double merit() const {
    return shooting_.cost + nu_.dot(shooting_.goals) + 0.5 * rho_ * shooting_.goals.squaredNorm();
  }
  /// λ of the function that is lessened, which the motion has.
  Vector costates() const {
    const long n = shooting_.nx(), N = shooting_.N();
    Vector lambda((N + 1) * n);
    lambda.tail(n) = shooting_.qp.C.transpose() * weighted();
    for (long k = N; k-- > 0;) {
      const auto& s = shooting_.qp.stages[size_t(k)];
      lambda.segment(k * n, n) = s.g.head(n) + s.A.transpose() * lambda.segment((k + 1) * n, n);
    }
    return lambda;
  }
  Vector weighted() const { return nu_ + rho_ * shooting_.goals; }

  /// The programme without goals, whose weight is part of the last block. @return whether solved
  bool sweep(bool exact, double more) {
    auto& qp = shooting_.qp;
    shooting_.curve(costates(), weighted(), exact);
    const Matrix C = qp.C;
    qp.last_H += rho_ * C.transpose() * C;
    qp.last_g = C.transpose() * weighted();
    qp.C.resize(0, shooting_.nx());
    qp.c.resize(0);
    const auto result = sweep_.solve(qp, more, 0);
    qp.C = C;
    qp.c = shooting_.goals;
    return result == RiccatiQp::Result::ok;
  }

  /// One step. @return whether it was worth another
  bool improve() {
    if (o_.stop && o_.stop->load(std::memory_order_relaxed)) return false;
    const double was = merit();
    shooting_.differentiate();
    bool ok = exact_ && sweep(true, 0);
    exact_ = ok;  // not convex: without second derivatives for the rest of the round
    for (double more = 0; !ok && more < 1e12; more = std::max(1e-8, 10 * more))
      ok = sweep(false, more);
    if (!ok) return false;
    Vector move(v_.size()), trial;
    for (long k = 0; k <= shooting_.N(); ++k)
      move.segment(shooting_.at_x(k), shooting_.nx()) = sweep_.x[size_t(k)];
    for (long k = 0; k < shooting_.N(); ++k)
      move.segment(shooting_.at_w(k), shooting_.nw()) = sweep_.w[size_t(k)];
    for (double alpha = 1; alpha > 1e-4; alpha *= 0.5)
      if (shooting_.follow(v_, move, alpha, sweep_, trial) &&
          merit() < was - 1e-4 * alpha * std::fabs(was)) {
        v_ = trial;
        return merit() < was - 1e-2 * std::fabs(was);
      }
    (void)shooting_.evaluate(v_);
    return false;
  }

  const PlannerOptions& o_;
  Shooting& shooting_;
  Vector& v_;
  RiccatiQp sweep_;
  Vector nu_;
  double rho_ = 1;
  bool exact_ = true;
};

}  // namespace

int approach(Shooting& shooting, Vector& v, const PlannerOptions& options) {
  return Approach(shooting, v, options).run();
}

}  // namespace porthos::planning::detail
