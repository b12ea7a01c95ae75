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

// The control: a false claim would give a wrong gradient; it is refused, and check() names it.
TEST(RateTimeScale, RefusesAFalseClaim) {
  const UserModel<Relativistic> liar{Relativistic{true}}, honest{Relativistic{}};
  std::string why;
  try {
    RateTimeScale(liar, 1);
  } catch (const InvalidArgument& e) {
    why = e.what();
  }
  EXPECT_NE(why.find("more than degree two in its momenta"), std::string::npos) << why;
  const std::string said = check(liar).text();
  EXPECT_NE(said.find("VIOLATED quadratic"), std::string::npos) << said;
  EXPECT_TRUE(check(honest).holds());
  EXPECT_FALSE(falsely_quadratic(honest));
  EXPECT_FALSE(false_trait(liar)) << "no method relies on this claim";
}

// A cart in metres and a pole in radians, a million newtons of potential: the claim is judged by
// the kinetic energy alone, and the difference is exact in any mixture of units.
struct CartPole {
  double cart = 1, bias = 0, cube = 0, hidden = 0;
  Description description() const {
    Description d{"cart and pole", 4, 0, {}, {}, {}, {.canonical = true, .quadratic = true}};
    d.blocks = {{"cart", BlockKind::linear, 0, 1, 2, "m", "kg m/s"},
                {"pole", BlockKind::angle, 1, 1, 3, "rad", "kg m^2/s"}};
    return d;
  }
  template <class T>
  T inertia(const T& c) const {
    return T(cart) * (T(2.0) - c * c);
  }
  template <class T>
  T kinetic(std::span<const T> x) const {
    const T c = cos(x[1]);
    return (T(0.5) * x[2] * x[2] - c * x[2] * x[3] + x[3] * x[3]) / inertia(c);
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    const T away = T(hidden) * cos(x[1]);
    return (kinetic(x) + away) + T(bias) * (T(1.0) + cos(x[1])) + T(cube) * x[3] * x[3] * x[3] -
           away;
  }
  template <class T>
  void gradient(std::span<const T> x, std::span<T> e) const {
    const T c = cos(x[1]), s = sin(x[1]), m = inertia(c);
    e[0] = T(0.0);
    e[1] = s * (x[2] * x[3] - T(2.0 * cart) * c * kinetic(x)) / m - T(bias) * s;
    e[2] = (x[2] - c * x[3]) / m;
    e[3] = (T(2.0) * x[3] - c * x[2]) / m + T(3.0 * cube) * x[3] * x[3];
  }
};

TEST(RateTimeScale, UnitsAndPotentialsDoNotMatter) {
  struct Trial {
    CartPole plant;
    double length;
  };
  for (const auto& [plant, length] :
       {Trial{{}, 1}, {{}, 1e-3}, {{}, 1e3}, {{}, 0}, {{.cart = 1e6}, 1}, {{.bias = 1e6}, 1}}) {
    const UserModel<CartPole> model{plant};
    EXPECT_FALSE(falsely_quadratic(model));
    const RateTimeScale rates(model, 0.5, length);
    const std::vector<double> x{0.3, 0.7, -2, 5};
    const auto near = evaluate<double>(rates, x);
    // the same by central differences of sigma itself, in 113 bits
    double off = 0, size = 0;
    for (size_t i = 0; i < x.size(); ++i) {
      std::vector<Quad> up(x.begin(), x.end()), down = up;
      const Quad d = Quad(1e-9);
      up[i] = up[i] + d;
      down[i] = down[i] - d;
      const Quad slope =
          (evaluate<Quad>(rates, up).sigma - evaluate<Quad>(rates, down).sigma) / (Quad(2.0) * d);
      off = std::max(off, std::fabs(near.gradient[i] - double(slope)));
      size = std::max(size, std::fabs(double(slope)));
    }
    // Of two slopes of the potential only the rounding is left.
    const double bound = 1e-14 + 1e-16 * plant.bias;
    std::printf("  mass %g, bias %g, length %g: off by %.1e of the largest   bound %.0e\n",
                plant.cart, plant.bias, length, off / size, bound);
    EXPECT_LE(off, bound * size);
  }
  // Terms of a thousand joules that cancel in H round like a thousand joules.
  EXPECT_FALSE(falsely_quadratic(UserModel<CartPole>{CartPole{.bias = 1, .hidden = 1e4}}));
  EXPECT_TRUE(check(UserModel<CartPole>{CartPole{.bias = 1, .hidden = 1e4}}).holds());
  EXPECT_TRUE(falsely_quadratic(UserModel<CartPole>{CartPole{.bias = 1e3, .cube = 1e-3}}));
}

}  // namespace
}  // namespace porthos::phs::time_scale_test
