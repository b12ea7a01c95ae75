// IPOPT as an oracle: the same problems, the same optima, and what both take.
#include "tests/places.h"
#ifdef PORTHOS_HAVE_IPOPT
#include <gtest/gtest.h>

#include <unistd.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <ctime>
#include <fstream>

#include "adapters/ipopt/ipopt.h"
#include "planning/nonlinear_programme.h"
#include "tests/planning/problems.h"

namespace porthos::planning::ipopt_test {
namespace {

using Vec = std::vector<double>;
using adapters::IpoptOptions, adapters::solve_by_ipopt;
using Matrix = Eigen::MatrixXd;

/// The unknowns of a plan, states before inputs.
Vec unknowns(const Plan& plan) {
  Vec z = plan.motion.x;
  z.insert(z.end(), plan.motion.u.begin(), plan.motion.u.end());
  return z;
}

/// Multipliers of the rows: λ_1 to λ_N, those of the goals, and 0 for what has limits.
Vec multipliers(const Problem& p, const Plan& plan, size_t rows) {
  Vec m(plan.costates.begin() + long(p.start.size()), plan.costates.end());
  m.insert(m.end(), plan.goal_multipliers.begin(), plan.goal_multipliers.end());
  m.resize(rows, 0.0);
  return m;
}

/// The least second derivative of the Lagrangian along a unit move that the equations and the
/// limits which are touched allow.
double least_curvature(const Problem& p, const Plan& plan) {
  NonlinearProgramme programme(p);
  const Vec z = unknowns(plan);
  const long n = long(z.size()), m = long(programme.rows().lower.size());
  EXPECT_TRUE(programme.go_to(z));
  const auto& at = programme.jacobian_pattern();
  const auto& at_h = programme.hessian_pattern();
  Vec J(at.row.size()), H(at_h.row.size()), c(static_cast<size_t>(m));
  programme.jacobian(J);
  programme.hessian(1, multipliers(p, plan, size_t(m)), H);
  programme.values(c);
  const auto touched = [](double x, double low, double high) {
    return std::min(x - low, high - x) < 1e-5;
  };
  Matrix rows = Matrix::Zero(m + n, n), curvature = Matrix::Zero(n, n);
  for (size_t i = 0; i < J.size(); ++i)
    if (touched(c[size_t(at.row[i])], programme.rows().lower[size_t(at.row[i])],
                programme.rows().upper[size_t(at.row[i])]))
      rows(at.row[i], at.column[i]) = J[i];
  for (long i = 0; i < n; ++i)
    if (touched(z[size_t(i)], programme.unknowns().lower[size_t(i)],
                programme.unknowns().upper[size_t(i)]))
      rows(m + i, i) = 1;
  for (size_t i = 0; i < H.size(); ++i)
    curvature(at_h.row[i], at_h.column[i]) = curvature(at_h.column[i], at_h.row[i]) = H[i];
  const Eigen::ColPivHouseholderQR<Matrix> qr(rows.transpose());
  const Matrix Q = qr.householderQ();
  const Matrix moves = Q.rightCols(n - qr.rank());
  const Eigen::SelfAdjointEigenSolver<Matrix> spectrum(moves.transpose() * curvature * moves,
                                                       Eigen::EigenvaluesOnly);
  return spectrum.eigenvalues()[0];
}

/// How far two plans that satisfy the conditions to their residuals may be apart.
struct Bound {
  double cost, place;
};
/// What is left of complementarity is at most m r (1 + the largest multiplier) of the cost, over m
/// limits; a slope g moves the optimum by |g|/σ, a gap of the cost by √(2 gap/σ), over the least
/// curvature σ.
Bound bound_of(const Problem& p, const Plan& a, const Plan& b, double curvature) {
  double largest = 1;
  for (const double l : a.costates) largest = std::max(largest, 1 + std::fabs(l));
  const auto& l = p.limits;
  const size_t per_stage = l.path.size() + l.rate.size(),
               per_step = l.input_lower.size() * size_t(p.per_interval()) + l.state_lower.size();
  const double limits = 2 * p.intervals * double(per_step + per_stage * size_t(p.stages)),
               rounding = 1e-13 * a.cost,
               gap = largest * limits * std::max(a.complementarity, b.complementarity) + rounding,
               slope = largest * std::sqrt(double(a.motion.x.size() + a.motion.u.size())) *
                       (a.stationarity + b.stationarity);
  return {gap + slope * slope / curvature,
          slope / curvature + std::sqrt(2 * (gap - rounding) / curvature) + 1e-10};
}

double apart(const Vec& a, const Vec& b) {
  double most = 0;
  for (size_t i = 0; i < a.size(); ++i) most = std::max(most, std::fabs(a[i] - b[i]));
  return most;
}

/// Milliseconds of the processor.
template <class Solve>
double cpu(Plan& plan, Solve solve) {
  const std::clock_t begin = std::clock();
  plan = solve();
  return 1e3 * double(std::clock() - begin) / CLOCKS_PER_SEC;
}

void print(const char* who, const Plan& p, double ms) {
  std::printf("    %-14s %-20s %4d iterations %8.1f ms  J = %.9f\n", who, to_string(p.status),
              p.iterations, ms, p.cost);
}

/// Ours and IPOPT's with exact second derivatives end at one optimum.
void expect_one_optimum(const char* name, const Problem& p, const Trajectory& guess,
                        const PlannerOptions& o = {}) {
  Plan ours, theirs, estimated;
  std::printf("  %s\n", name);
  print("ours", ours, cpu(ours, [&] { return solve(p, guess, o); }));
  PlannerOptions more = o;
  more.iterations = 1000;
  print("IPOPT", theirs, cpu(theirs, [&] { return solve_by_ipopt(p, guess, more); }));
  print("IPOPT, L-BFGS", estimated, cpu(estimated, [&] {
          return solve_by_ipopt(p, guess, more, {.hessian = IpoptOptions::Hessian::lbfgs});
        }));
  ASSERT_EQ(ours.status, Plan::Status::optimal);
  ASSERT_EQ(theirs.status, Plan::Status::optimal);
  EXPECT_LT(theirs.residual, 1e-9);
  const double curvature = least_curvature(p, ours);
  const Bound bound = bound_of(p, ours, theirs, curvature);
  const double cost = std::fabs(ours.cost - theirs.cost), x = apart(ours.motion.x, theirs.motion.x),
               u = apart(ours.motion.u, theirs.motion.u);
  std::printf(
      "    apart by %.1e (bound %.1e) in cost, %.1e and %.1e (%.1e) in states and inputs; least "
      "curvature %.2g\n",
      cost, bound.cost, x, u, bound.place, curvature);
  EXPECT_GT(curvature, 0) << "no minimum";
  EXPECT_LE(cost, bound.cost);
  EXPECT_LE(std::max(x, u), bound.place);
  // control: the problem with a hundredth more time has another optimum
  Problem longer = p;
  longer.duration *= 1.01;
  const Plan other = solve_by_ipopt(longer, ours.motion);
  EXPECT_GT(std::fabs(other.cost - ours.cost), 10 * bound.cost);
  EXPECT_GT(std::max(apart(ours.motion.x, other.motion.x), apart(ours.motion.u, other.motion.u)),
            10 * bound.place);
}

TEST(Ipopt, CartPole) {
  const Problem p = test::cart_pole_swing_up(2, 40);
  expect_one_optimum("cart and pendulum", p, straight(p, {1, M_PI, 0, 0}));
}

TEST(Ipopt, Acrobot) {
  const Problem p = test::acrobot_swing_up();
  expect_one_optimum("acrobot", p, test::acrobot_guess(p));
}

TEST(Ipopt, LimitsOfInputsAndStates) {
  Problem p = test::cart_pole_swing_up(2, 40);
  p.limits = {
      {-12}, {12}, {-0.3, -no_limit, -no_limit, -no_limit}, {1.05, no_limit, no_limit, no_limit}};
  expect_one_optimum("cart and pendulum, force and track limited", p, straight(p, {1, M_PI, 0, 0}));
}

TEST(Ipopt, LimitsOfADistance) {
  const Problem p = test::round_a_disc(40);
  expect_one_optimum("a mass round a disc", p, test::beside_the_disc(p, 1));
}

TEST(Ipopt, LimitsOfRates) {
  Problem p = test::cart_pole_swing_up(2, 40);
  for (const double speed : {1.81212, 1.80080}) {
    p.limits.rate = {speed, no_limit, no_limit, no_limit};
    expect_one_optimum("cart and pendulum, speed limited", p, straight(p, {1, M_PI, 0, 0}));
  }
}

/// Dynamics in which the derivative of the cart's momentum by the force is a hundredth off.
class Wrong final : public Dynamics {
 public:
  explicit Wrong(std::shared_ptr<Dynamics> right)
      : Dynamics(right->nx(), right->nu()), right_(std::move(right)) {}
  void field(In t, In x, In u, Out f) override { right_->field(t, x, u, f); }
  void jacobian(In t, In x, In u, Out f, Out J) override {
    right_->jacobian(t, x, u, f, J);
    const size_t by_force = size_t(nx() * nx() + 2), point = size_t(nx() * (nx() + nu()));
    for (size_t i = 0; i < t.size(); ++i) J[i * point + by_force] *= 1.01;
  }
  void hessian(In t, In x, In u, In lambda, Out H) override { right_->hessian(t, x, u, lambda, H); }

 private:
  std::shared_ptr<Dynamics> right_;
};

/// IPOPT compares all derivatives of the programme, goals and limits of every kind included, with
/// differences. Control: dynamics with a derivative that is a hundredth off.
TEST(Ipopt, ComparesDerivatives) {
  Problem p = test::cart_pole_swing_up(2, 4);
  p.cost.rate = {0.1, 0.2, 0, 0};
  p.cost.drawn = {{0, 0, 0.3, 1}};
  p.goals.back() = {{}, 1, 0.5};  // a rate
  p.limits.rate = {4, no_limit, no_limit, no_limit};
  p.limits.path = {{.number = path_number(4, [](double, auto x) { return x[0] * x[1]; }),
                    .lower = -5,
                    .upper = 9}};
  const auto guess = straight(p, {1, M_PI, 0, 0});
  const auto found = [&] {
    const std::string log = testing::TempDir() + "porthos_ipopt_" + std::to_string(getpid());
    (void)solve_by_ipopt(p, guess, {.iterations = 1}, {.check_derivatives = true, .log = log});
    std::ifstream file(log);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    std::remove(log.c_str());
    const auto none = text.find("No errors detected"),
               at = none != text.npos ? none : text.find("Derivative checker detected");
    EXPECT_NE(at, text.npos) << text;
    return text.substr(at, text.find('\n', at) - at);
  };
  const std::string right = found();
  p.dynamics = std::make_shared<Wrong>(p.dynamics);
  const std::string wrong = found();
  std::printf("  %s; with one that is wrong: %s\n", right.c_str(), wrong.c_str());
  EXPECT_EQ(right, "No errors detected by derivative checker.");
  EXPECT_NE(wrong, right);
}

/// From a straight line, of which the acrobot's motion knows nothing, IPOPT finds the swing-up that
/// costs least of those known (tests/data/README.md).
TEST(Ipopt, AcrobotFromAfar) {
  const Problem p = test::acrobot_swing_up();
  Plan ours, theirs;
  const auto line = straight(p, {M_PI, 0, 0, 0});
  print("ours", ours, cpu(ours, [&] { return solve(p, line); }));
  print("IPOPT", theirs, cpu(theirs, [&] { return solve_by_ipopt(p, line); }));
  ASSERT_EQ(theirs.status, Plan::Status::optimal);
  Problem fine = p;
  fine.stages = 8;
  fine.intervals = 160;
  const Plan plan = solve(fine, resample(p, theirs.motion, fine));
  std::printf("    by gauss16: J off by %.1e (bound 1e-8)\n", plan.cost - 21.51759979);
  EXPECT_NEAR(plan.cost, 21.51759979, 1e-8);
}

TEST(Ipopt, ByItsName) {
  adapters::add_ipopt();
  const Problem p = test::unit_mass(1, 1, 10);
  const auto guess = straight(p, {1, 0});
  const Plan plan = solve(p, guess, {.solver = "ipopt"});
  EXPECT_EQ(unknowns(plan), unknowns(solve_by_ipopt(p, guess)));
  EXPECT_NE(unknowns(plan), unknowns(solve(p, guess)));  // control: the last digits are others
  EXPECT_THROW(solve(p, guess, {.solver = "ipop"}), InvalidArgument);
}

TEST(Ipopt, Refusals) {
  const Problem p = test::unit_mass(1, 1, 4);
  const auto words = [&](const Trajectory& guess) -> std::string {
    try {
      (void)solve_by_ipopt(p, guess);
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(words(straight(p, {NAN, 0})),
            "IPOPT cannot begin, expected a guess whose steps have a solution");
  EXPECT_EQ(words({{0, 0}, {0}}), "states of the guess has 2 entries, expected 10");
  EXPECT_THROW(solve_by_ipopt(p, straight(p, {1, 0}), {}, {.log = "/nowhere/log"}), IoError);
  const std::atomic<bool> stop = true;
  Problem long_enough = test::cart_pole_swing_up(2, 20);
  EXPECT_EQ(
      solve_by_ipopt(long_enough, straight(long_enough, {1, M_PI, 0, 0}), {.stop = &stop}).status,
      Plan::Status::stopped);
}

}  // namespace
}  // namespace porthos::planning::ipopt_test
#endif
