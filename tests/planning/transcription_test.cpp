// The parts of the solver against independent ways to the same numbers: the steps and their
// derivatives against the house's integrators in duals, the Riccati sweep against the whole system
// of equations, costates against differences and their order, plans against runs.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

#include "integrators/core/integrator.h"
#include "phs/network/network.h"
#include "planning/detail/shooting.h"
#include "tests/planning/problems.h"
#include "tests/support/robots.h"

namespace porthos::planning::transcription_test {
namespace {

using detail::Matrix;
using detail::Vector;
using Vec = std::vector<double>;

Problem ets_vii(int stages, Inputs inputs) {
  const auto robot = test::ets_vii(2);
  std::vector<std::string> ports;
  for (int i = 1; i <= 6; ++i) ports.push_back("joint_" + std::to_string(i) + ".torque");
  Problem p;
  p.dynamics = dynamics_of(robot.model, ports);
  p.stages = stages;
  p.duration = 0.5;
  p.intervals = 1;
  p.inputs = inputs;
  p.start = robot.start.x;
  p.cost.input = Vec(6, 1e-3);
  p.cost.rate = Vec(26, 0.0);
  for (size_t k = 3; k < 7; ++k) p.cost.rate[k] = 0.7;
  p.cost.drawn = {{2, 9, 0.3, 1e-1}};
  return p;
}
Vec some(size_t n, unsigned seed, double size) {
  std::mt19937 rng(seed);
  Vec v(n);
  for (double& x : v) x = std::uniform_real_distribution<double>(-size, size)(rng);
  return v;
}

/// The end of the step and A, against the integrator of the house without inputs. Control: half a
/// step.
TEST(Transcription, StepIsTheIntegratorsStep) {
  for (const int stages : {1, 2, 3, 8}) {
    const Problem p = ets_vii(stages, Inputs::held);
    const auto robot = test::ets_vii(2);
    const std::string method = "gauss" + std::to_string(2 * stages);
    const auto table = integrators::gauss_table<double>(stages);
    detail::GaussInterval interval(p, table, 0);
    const Vec none(6, 0.0);
    ASSERT_TRUE(interval.solve(p.start.data(), none.data()));
    interval.differentiate();
    const auto step =
        integrators::make_basic_integrator<phs::Dual>(method, *robot.model, phs::Dual(0.5));
    double off = 0, slope_off = 0;
    for (size_t j = 0; j < 26; ++j) {
      std::vector<phs::Dual> x(p.start.begin(), p.start.end());
      x[j].d = 1;
      phs::BasicState<phs::Dual> state(robot.model->description(), x);
      ASSERT_EQ(step->step(state), integrators::Outcome::ok);
      for (size_t i = 0; i < 26; ++i) {
        const double scale = 1 + std::fabs(state.x[i].v);
        off = std::max(off, std::fabs(interval.end()[long(i)] - state.x[i].v) / scale);
        slope_off = std::max(slope_off, std::fabs(interval.A()(long(i), long(j)) - state.x[i].d) /
                                            (1 + std::fabs(state.x[i].d)));
      }
    }
    std::printf("  %-8s end off by %.1e (bound 4e-15), A by %.1e (bound 1e-13)\n", method.c_str(),
                off, slope_off);
    EXPECT_LT(off, 4e-15);
    EXPECT_LT(slope_off, 1e-13);
    EXPECT_GT((interval.end() - Eigen::Map<const Vector>(p.start.data(), 26)).norm(), 1e-3);
  }
}

/// B, the gradient and the Hessian of cost + λᵀx' + weightsᵀ (rates, a number of the state) against
/// central differences.
TEST(Transcription, DerivativesOfAnInterval) {
  for (const auto inputs : {Inputs::held, Inputs::at_stages})
    for (const int stages : {2, 3}) {
      Problem p = ets_vii(stages, inputs);
      p.limits.rate.assign(26, no_limit);
      p.limits.rate[7] = p.limits.rate[9] = 1;
      const auto bent = [](double t, auto x) {
        return (1 + t) * x[8] * x[8] * x[9] + x[20] * x[7];
      };
      p.limits.path = {{.number = path_number(26, bent), .upper = 1}};
      const auto table = integrators::gauss_table<double>(stages);
      detail::GaussInterval interval(p, table, 0);
      const long nw = p.per_interval(), n = 26;
      Vec z = p.start;
      const Vec w = some(size_t(nw), 1, 2);
      z.insert(z.end(), w.begin(), w.end());
      const Vec l = some(26, 2, 1);
      const Vector lambda = Eigen::Map<const Vector>(l.data(), n);
      const Vec m = some(size_t(3 * stages), 3, 2);
      const Vector weights = Eigen::Map<const Vector>(m.data(), 3 * stages);
      const auto at = [&](const Vec& y) {
        EXPECT_TRUE(interval.solve(y.data(), y.data() + n));
        interval.differentiate();
        Vector g = interval.gradient() + interval.path_rows().transpose() * weights;
        g.head(n) += interval.A().transpose() * lambda;
        g.tail(nw) += interval.B().transpose() * lambda;
        return std::pair(
            interval.cost() + lambda.dot(interval.end()) + weights.dot(interval.path()), g);
      };
      const Vector g = at(z).second;
      Matrix H, gauss_newton;
      interval.hessian(lambda, true, H, weights.data());
      interval.hessian(lambda, false, gauss_newton, weights.data());
      double slope = 0, curvature = 0, control = 0;
      for (long k = 0; k < n + nw; ++k) {
        const double e = 1e-5 * std::max(1.0, std::fabs(z[size_t(k)]));
        Vec plus = z, minus = z;
        plus[size_t(k)] += e;
        minus[size_t(k)] -= e;
        const auto a = at(plus), b = at(minus);
        const double width = plus[size_t(k)] - minus[size_t(k)];
        slope = std::max(slope, std::fabs((a.first - b.first) / width - g[k]) / g.norm());
        const Vector column = (a.second - b.second) / width;
        curvature = std::max(curvature, (column - H.col(k)).norm() / H.norm());
        control = std::max(control, (column - gauss_newton.col(k)).norm() / H.norm());
      }
      std::printf(
          "  gauss%d: gradient off by %.1e (bound 1e-8), Hessian by %.1e (1e-8), without the "
          "curvature of f by %.1e\n",
          2 * stages, slope, curvature, control);
      EXPECT_LT(slope, 1e-8);
      EXPECT_LT(curvature, 1e-8);
      EXPECT_GT(control, 1e-3);
      EXPECT_LT((H - H.transpose()).norm(), 1e-12 * H.norm());
    }
}

/// The sweep against LU of all equations at once.
TEST(Transcription, RiccatiSweep) {
  const long n = 3, nw = 2, N = 5, m = 2, z = n + nw;
  std::mt19937 rng(3);
  const auto random = [&](long rows, long cols) {
    Matrix M(rows, cols);
    for (long i = 0; i < rows; ++i)
      for (long j = 0; j < cols; ++j) M(i, j) = std::uniform_real_distribution<double>(-1, 1)(rng);
    return M;
  };
  detail::QuadraticProgramme qp;
  for (long k = 0; k < N; ++k) {
    Matrix H = random(z, z);
    H = H * H.transpose() + 0.1 * Matrix::Identity(z, z);
    qp.stages.push_back({random(n, n), random(n, nw), H, random(n, 1), random(z, 1)});
  }
  Matrix last = random(n, n);
  qp.last_H = last * last.transpose();
  qp.last_g = random(n, 1);
  qp.C = random(m, n);
  qp.c = random(m, 1);
  // unknowns x_1 … x_N, w_0 … w_N-1, λ_1 … λ_N, ν
  const long at_w = N * n, at_l = at_w + N * nw, at_nu = at_l + N * n, all = at_nu + m;
  Matrix K = Matrix::Zero(all, all);
  Vector r = Vector::Zero(all);
  for (long k = 0; k < N; ++k) {
    const auto& s = qp.stages[size_t(k)];
    const long w = at_w + k * nw, l = at_l + k * n, next = k * n, x = next - n;
    K.block(w, w, nw, nw) = s.H.bottomRightCorner(nw, nw);
    r.segment(w, nw) = -s.g.tail(nw);
    if (k > 0) {
      K.block(x, x, n, n) += s.H.topLeftCorner(n, n);
      K.block(x, w, n, nw) += s.H.topRightCorner(n, nw);
      K.block(w, x, nw, n) += s.H.bottomLeftCorner(nw, n);
      K.block(l, x, n, n) = s.A;
      K.block(x, l, n, n) = s.A.transpose();
      r.segment(x, n) -= s.g.head(n);
    }
    K.block(l, w, n, nw) = s.B;
    K.block(w, l, nw, n) = s.B.transpose();
    K.block(l, next, n, n) = -Matrix::Identity(n, n);
    K.block(next, l, n, n) = -Matrix::Identity(n, n);
    r.segment(l, n) = -s.d;
  }
  const long x = (N - 1) * n;
  K.block(x, x, n, n) += qp.last_H;
  r.segment(x, n) -= qp.last_g;
  K.block(at_nu, x, m, n) = qp.C;
  K.block(x, at_nu, n, m) = qp.C.transpose();
  r.segment(at_nu, m) = -qp.c;
  const Vector exact = K.partialPivLu().solve(r);
  const auto compare = [&](const detail::RiccatiQp& sweep) {
    double off = (sweep.nu - exact.tail(m)).norm();
    for (long k = 0; k < N; ++k) {
      off = std::max(off, (sweep.x[size_t(k + 1)] - exact.segment(k * n, n)).norm());
      off = std::max(off, (sweep.w[size_t(k)] - exact.segment(at_w + k * nw, nw)).norm());
      off = std::max(off, (sweep.lambda[size_t(k + 1)] - exact.segment(at_l + k * n, n)).norm());
    }
    return off / exact.norm();
  };
  detail::RiccatiQp sweep;
  for (const double rho : {0.0, 10.0, 1e4}) {  // which changes no solution
    ASSERT_EQ(sweep.solve(qp, 0, rho), detail::RiccatiQp::Result::ok);
    std::printf("  rho = %g: off by %.1e (bound 1e-11)\n", rho, compare(sweep));
    EXPECT_LT(compare(sweep), 1e-11);
    EXPECT_EQ(sweep.unreached, 0);
  }
  ASSERT_EQ(sweep.solve(qp, 0, 0, true), detail::RiccatiQp::Result::ok);
  EXPECT_LT(compare(sweep), 1e-12);
  ASSERT_EQ(sweep.solve(qp, 1e-3, 0), detail::RiccatiQp::Result::ok);
  EXPECT_GT(compare(sweep), 1e-6);  // the control: a changed programme
  qp.stages[2].H.bottomRightCorner(nw, nw) -= 100 * Matrix::Identity(nw, nw);
  EXPECT_EQ(sweep.solve(qp, 0, 0), detail::RiccatiQp::Result::not_convex);
}

/// The costates of inputs at the stages have the order 2s of the method, as the states. A crane:
/// the pole hangs at both ends.
TEST(Transcription, CostatesHaveTheMethodsOrder) {
  const auto crane = [](int stages, int intervals) {
    Problem p = test::cart_pole_swing_up(stages, intervals);
    p.goals = test::ends_at({1, 0, 0, 0});
    return p;
  };
  const Problem fine = crane(8, 40);
  const Plan exact = solve(fine, straight(fine, {1, 0, 0, 0}));
  ASSERT_EQ(exact.status, Plan::Status::optimal);
  struct {
    int stages, intervals;
  } const cases[] = {{1, 80}, {2, 40}, {3, 20}, {4, 20}};
  for (const auto& c : cases) {
    double error[2], cost[2];
    for (int fold = 0; fold < 2; ++fold) {
      const int N = c.intervals << fold;
      const Problem p = crane(c.stages, N);
      const Plan plan = solve(p, resample(fine, exact.motion, p));
      EXPECT_EQ(plan.status, Plan::Status::optimal);
      error[fold] = 0;
      for (int k = 0; k <= 4; ++k)  // at quarters of the motion
        for (size_t i = 0; i < 4; ++i)
          error[fold] = std::max(error[fold], std::fabs(plan.costates[size_t(k * N / 4) * 4 + i] -
                                                        exact.costates[size_t(k * 10) * 4 + i]));
      cost[fold] = std::fabs(plan.cost - exact.cost);
    }
    const double order = std::log2(error[0] / error[1]);
    std::printf(
        "  gauss%d, N = %d and %d: costates off by %.1e and %.1e, order %.2f (bound %d "
        "within 0.3); cost %.1e and %.1e\n",
        2 * c.stages, c.intervals, 2 * c.intervals, error[0], error[1], order, 2 * c.stages,
        cost[0], cost[1]);
    EXPECT_NEAR(order, 2 * c.stages, 0.3);
  }
}

/// λ_0 is the derivative of the least cost by the start; minus ν that by the goals.
TEST(Transcription, MultipliersAreDerivatives) {
  Problem p = test::cart_pole_swing_up(3, 20);
  const Plan plan = solve(p, straight(p, {1, M_PI, 0, 0}));
  ASSERT_EQ(plan.status, Plan::Status::optimal);
  const auto cost_at = [&](auto& number, double e) {
    const double was = number;
    number += e;
    const Plan moved = solve(p, plan.motion);
    EXPECT_EQ(moved.status, Plan::Status::optimal);
    number = was;
    return moved.cost;
  };
  const double e = 1e-5;
  for (size_t k = 0; k < 4; ++k) {
    const double by_start = (cost_at(p.start[k], e) - cost_at(p.start[k], -e)) / (2 * e),
                 by_goal = (cost_at(p.goals[k].value, e) - cost_at(p.goals[k].value, -e)) / (2 * e);
    EXPECT_NEAR(by_start, plan.costates[k], 1e-5 * (1 + std::fabs(by_start)));
    EXPECT_NEAR(by_goal, -plan.goal_multipliers[k], 1e-5 * (1 + std::fabs(by_goal)));
  }
}

/// The planned forces through the house's integrator land where planned. Control: the inputs one
/// interval late.
TEST(Transcription, ReplayLandsWherePlanned) {
  for (const auto inputs : {Inputs::held, Inputs::at_stages}) {
    Problem p = test::cart_pole_swing_up(4, 40);
    p.inputs = inputs;
    const Plan plan = solve(p, straight(p, {1, M_PI, 0, 0}));
    ASSERT_EQ(plan.status, Plan::Status::optimal);
    const auto end_of = [&](const Trajectory& t) {
      phs::Network n("cart-pole");
      n.add("plant", test::cart_pole()).main("plant");
      n.source("force", "plant.slide.force", input_signal(p, t, 0));
      const auto model = n.build();
      phs::State state(model->description(), p.start);
      const auto method = integrators::make_integrator("gauss8", *model, p.step());
      for (int k = 0; k < p.intervals; ++k)
        EXPECT_EQ(method->step(state), integrators::Outcome::ok);
      Vec x = state.x;
      size_t angle = 0;
      for (const auto& b : model->description().blocks)
        if (b.kind == phs::BlockKind::angle)
          x[size_t(b.at)] += 2 * M_PI * double(state.turns[angle++]);
      double off = 0;
      for (size_t i = 0; i < 4; ++i)
        off = std::max(off, std::fabs(x[i] - plan.motion.x[plan.motion.x.size() - 4 + i]));
      return off;
    };
    Trajectory late = plan.motion;
    std::rotate(late.u.begin(), late.u.begin() + p.per_interval(), late.u.end());
    std::printf("  off by %.1e (bound 1e-12); one interval late %.1e\n", end_of(plan.motion),
                end_of(late));
    EXPECT_LT(end_of(plan.motion), 1e-12);
    EXPECT_GT(end_of(late), 1e-3);
  }
}

}  // namespace
}  // namespace porthos::planning::transcription_test
