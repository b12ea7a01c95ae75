// The time scale from rates: its gradient by two gradients of H where the system is quadratic in
// its momenta, by duals where it is not, and what a false claim does.
#include "phs/system/time_scale.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "phs/system/check.h"
#include "phs/system/user_model.h"
#include "tests/support/robots.h"

namespace porthos::phs::time_scale_test {
namespace {

template <class T>
struct At {
  T sigma;
  std::vector<T> gradient;
};
template <class T>
At<T> evaluate(const RateTimeScale& s, const std::vector<T>& x) {
  const auto system = s.model().instantiate<T>();
  const auto scale = s.make_scale<T>();
  std::vector<T> e(x.size()), g(x.size());
  system->gradient(x, e);
  const T sigma = scale->with_gradient(x, e, g);
  return {sigma, g};
}
std::vector<double> random_numbers(size_t n, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::vector<double> x(n);
  for (double& v : x) v = normal(random);
  return x;
}

// H = sqrt(1 + p²) + 1 - cos q: not quadratic in p.
struct Relativistic {
  bool claims_quadratic = false;
  Description description() const {
    return {"relativistic pendulum",
            2,
            0,
            {{"angle", BlockKind::angle, 0, 1, 1, "rad", "1"}},
            {},
            {},
            {.canonical = true, .separable = true, .quadratic = claims_quadratic}};
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return sqrt(T(1.0) + x[1] * x[1]) + T(1.0) - cos(x[0]);
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    e[0] = sin(x[0]);
    e[1] = x[1] / sqrt(T(1.0) + x[1] * x[1]);
  }
};
/// ∂sigma/∂p with v = p/sqrt(1 + p²): -sigma³ v v'.
double slope_over_p(double p) {
  const double w = std::sqrt(1 + p * p), v = p / w, sigma = 1 / std::sqrt(1 + v * v);
  return -sigma * sigma * sigma * v / (w * w * w);
}

TEST(RateTimeScale, GradientOfARobotAgreesWith113Bits) {
  const auto robot = test::ets_vii(5);
  const RateTimeScale rates(*robot.model, 0.5);
  std::mt19937_64 random(1);
  double worst = 0;
  for (int k = 0; k < 20; ++k) {
    const auto x = random_numbers(size_t(robot.model->description().nx), random);
    const auto near = evaluate<double>(rates, x);
    const auto exact = evaluate<Quad>(rates, std::vector<Quad>(x.begin(), x.end()));
    double off = 0, size = 0;
    for (size_t i = 0; i < x.size(); ++i) {
      off = std::max(off, std::fabs(double(near.gradient[i] - exact.gradient[i])));
      size = std::max(size, std::fabs(double(exact.gradient[i])));
    }
    worst = std::max(worst, off / size);
  }
  // Two fields of a few units of rounding each, of which little cancels.
  std::printf("  ETS-VII, 20 random states: off by %.1e   bound 1e-14\n", worst);
  EXPECT_LE(worst, 1e-14);
}

TEST(RateTimeScale, GradientWithoutMomentaIsZero) {
  const auto robot = test::ets_vii(5);
  const RateTimeScale rates(*robot.model, 0.5);
  std::vector<double> x = robot.start.x;
  std::fill(x.begin() + long(x.size() / 2), x.end(), 0.0);
  for (const double g : evaluate<double>(rates, x).gradient) EXPECT_EQ(g, 0);
}

TEST(RateTimeScale, OthersGoByDuals) {
  const UserModel<Relativistic> honest{Relativistic{}};
  const RateTimeScale rates(honest, 1);
  for (const double p : {0.1, 1.0, 3.0}) {
    const auto at = evaluate<double>(rates, {0.3, p});
    EXPECT_NEAR(at.gradient[1], slope_over_p(p), 1e-15);
    EXPECT_EQ(at.gradient[0], 0);
  }
  EXPECT_THROW(evaluate<Quad>(rates, {0, 1}), InvalidArgument);
}

// The control: with a false claim the gradient is wrong, and check() names the claim.
TEST(RateTimeScale, AFalseClaimIsFound) {
  const UserModel<Relativistic> liar{Relativistic{true}};
  const RateTimeScale rates(liar, 1);
  const double off = evaluate<double>(rates, {0.3, 3.0}).gradient[1] - slope_over_p(3);
  std::printf("  off by %.1e   must exceed 1e-3\n", std::fabs(off));
  EXPECT_GT(std::fabs(off), 1e-3);
  const auto why = false_trait(liar);
  ASSERT_TRUE(why);
  EXPECT_NE(why->find("quadratic"), std::string::npos) << *why;
  EXPECT_TRUE(check(UserModel<Relativistic>{Relativistic{}}).holds());
}

}  // namespace
}  // namespace porthos::phs::time_scale_test
