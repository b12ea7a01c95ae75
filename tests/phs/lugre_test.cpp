// The bristle of LuGre friction: closed forms, passivity, rest, break-away, orders.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "integrators/core/integrator.h"
#include "phs/network/detail/resistances.h"
#include "phs/system/check.h"

namespace porthos::test::lugre_test {
namespace {

using integrators::Outcome;
using phs::LuGre;
using phs::Network;
using Numbers = std::vector<double>;

/// σ2 is the least that is passive.
const LuGre law{.coulomb = 1,
                .breakaway = 1.5,
                .stribeck = 0.01,
                .viscous = 10,
                .bristle_stiffness = 1e4,
                .bristle_damping = 20};

double slide(const LuGre& f, double v) {
  const double s = v / f.stribeck;
  return f.coulomb + (f.breakaway - f.coulomb) * std::exp(-s * s);
}

/// A mass that rubs, pushed by a force. State: momentum, bend.
std::shared_ptr<const phs::NetworkModel> block(const LuGre& f, double mass,
                                               const phs::FunctionPtr& push = nullptr) {
  Network n("block");
  n.add("mass", phs::inertia_element(mass, phs::translation));
  n.lugre("rub", "mass.body", f);
  if (push) n.source("push", "mass.body", push);
  return n.build();
}

/// A run that sums the works of each step.
template <class T = double>
struct Motion {
  std::shared_ptr<const phs::Model> model;
  std::unique_ptr<integrators::BasicIntegrator<T>> method;
  typename integrators::BasicIntegrator<T>::State state;
  std::unique_ptr<phs::System<T>> system;
  T H0, works{0.0};           ///< supplied less lost
  double least_loss = 1e300;  ///< of a step

  Motion(std::shared_ptr<const phs::Model> m, const std::vector<T>& x, T h,
         const char* name = "gauss8")
      : model(std::move(m)),
        method(integrators::make_basic_integrator<T>(name, *model, h)),
        state(model->description(), x),
        system(model->instantiate<T>()) {
    H0 = system->hamiltonian(state.x);
  }
  bool step() {
    if (method->step(state) != Outcome::ok) return false;
    const auto& powers = model->description().powers;
    for (size_t a = 0; a < powers.size(); ++a) {
      const T work = method->port_work()[a];
      const bool lost = powers[a].kind == phs::PowerKind::dissipated;
      works = lost ? works - work : works + work;
      if (lost) least_loss = std::min(least_loss, double(work));
    }
    return true;
  }
  void steps(int n) {
    for (int k = 0; k < n; ++k) ASSERT_TRUE(step()) << "step " << k;
  }
  double defect() { return double(system->hamiltonian(state.x) - H0 - works); }
  /// The force that the mass feels, without a push.
  T force() {
    std::vector<T> dx(state.x.size());
    system->field(method->time(state), state.x, {}, dx);
    return -dx[0];
  }
};

TEST(LuGre, IsPortHamiltonian) {
  const auto model = block(law, 2);
  // The largest bend is 1.5e-4 m; R >= 0 beyond it too.
  const auto r = phs::check(*model, {.samples = 200, .sizes = {0.1, 3e-4}});
  EXPECT_TRUE(r.holds()) << r.text();
  const auto& d = model->description();
  EXPECT_EQ(d.storages, (std::vector<std::string>{"mass.energy", "rub.energy"}));
  ASSERT_EQ(d.powers.size(), 1u);
  EXPECT_EQ(d.powers[0].name, "rub.loss");
  EXPECT_FALSE(d.traits.lossless);
  EXPECT_TRUE(model->casimirs().empty()) << "what slips is no spring";
  ASSERT_EQ(d.ports.size(), 1u) << "the port stays free";
  // Lanes have the bits of one, duals the slopes of differences.
  const auto one = model->instantiate<double>();
  const auto lanes = model->instantiate<phs::Pack4>();
  const auto dual = model->instantiate<phs::Dual>();
  for (const double v : {0.3, -0.02, 0.004, 0.0}) {
    const Numbers x{2 * v, 7e-5};
    Numbers a(2), b(2);
    std::vector<phs::Pack4> xs(x.begin(), x.end()), dxs(2);
    one->field(0, x, {}, a);
    lanes->field(phs::Pack4(0.0), xs, {}, dxs);
    for (size_t i = 0; i < 2; ++i) EXPECT_EQ(dxs[i][3], a[i]);
    for (size_t k = 0; k < 2; ++k) {
      std::vector<phs::Dual> xd(x.begin(), x.end()), dxd(2);
      xd[k].d = 1;
      dual->field(phs::Dual(0.0), xd, {}, dxd);
      const double by = k == 0 ? 1e-7 : 1e-9;
      Numbers above = x, below = x;
      above[k] += by;
      below[k] -= by;
      one->field(0, above, {}, a);
      one->field(0, below, {}, b);
      // At rest that is the mean of the slopes on both sides.
      for (size_t i = 0; i < 2; ++i)
        EXPECT_NEAR(dxd[i].d, (a[i] - b[i]) / (2 * by), 1e-5 * (1 + std::fabs(dxd[i].d))) << v;
    }
  }
}

/// At a constant rate σ0 z = g (1 - exp(-σ0 x / g)): the first slope of the force is σ0, the last
/// force g + σ2 v.
TEST(LuGre, BendsAndSlidesByClosedForms) {
  double worst = 0, slid = 0;
  for (const double v : {1e-4, 0.003, 0.02, 0.5}) {
    const double g = slide(law, v), mass = 1e16, length = g / law.bristle_stiffness;
    Motion<> run(block(law, mass), {mass * v, 0}, length / v / 50);
    for (int k = 0; k < 50 * 40; ++k) {
      ASSERT_TRUE(run.step());
      const double x = v * run.method->time(run.state);
      const double e = g * -std::expm1(-x / length);
      const double F = e + law.bristle_damping * v * (1 - e / g) + law.viscous * v;
      worst = std::max(worst, std::fabs(run.force() / F - 1));
    }
    slid = std::max(slid, std::fabs(run.force() / (g + law.viscous * v) - 1));
  }
  LuGre plain = law;
  plain.bristle_damping = plain.viscous = 0;
  Motion<> first(block(plain, 1e16), {1e6, 0}, 1.0);  // 1e-10 m/s for 1e4 s
  first.steps(100);
  const double stiffness = first.force() / (1e-10 * first.method->time(first.state));
  std::printf("  force %.1e, while it slides %.1e   bound 1e-10; first stiffness %.6g, is %g\n",
              worst, slid, stiffness, law.bristle_stiffness);
  EXPECT_LE(worst, 1e-10);
  EXPECT_LE(slid, 1e-10);
  EXPECT_NEAR(stiffness, law.bristle_stiffness, 1e-4 * law.bristle_stiffness);
}

double loss(const LuGre& f, double v, double e) {
  const auto D = phs::bristle_resistance(f, v, e);
  return D.rate * v * v + D.slip * e * e;
}

/// The loss is never negative within |e| <= F_s at the least viscous friction that is accepted. The
/// control with nine tenths of it makes energy: slow, then fast.
TEST(LuGre, NeverMakesEnergyWhereItIsAccepted) {
  LuGre less = law;
  less.viscous *= 0.9;
  std::mt19937_64 generator(3);
  std::uniform_real_distribution<double> any(-1, 1);
  double least = 1e300, control = 1e300;
  for (int k = 0; k < 200'000; ++k) {
    const double v = std::pow(10.0, 3 * any(generator)) * (k % 2 ? 1 : -1);
    const double e = law.breakaway * any(generator);
    least = std::min(least, loss(law, v, e));
    control = std::min(control, loss(less, v, e));
  }
  std::printf("  least loss %.1e W, control %.1e W\n", least, control);
  EXPECT_GE(least, 0);
  EXPECT_LE(control, -1);
  // A jump from rest at the largest bend to 100 m/s, the bend relaxes by its closed form: what goes
  // in until the loss turns positive is less than what is stored more.
  const auto made = [](const LuGre& f) {
    const double v = 100, g = slide(f, v), length = g / f.bristle_stiffness;
    double sum = 0, least_sum = 0;
    const int n = 4000;
    for (int k = 0; k < n; ++k) {
      const double x = length * (k + 0.5) / n;
      sum += loss(f, v, g + (f.breakaway - g) * std::exp(-x / length)) * length / v / n;
      least_sum = std::min(least_sum, sum);
    }
    return -least_sum;
  };
  EXPECT_EQ(made(law), 0);
  EXPECT_GT(made(less), 1e-6);

  EXPECT_NO_THROW(phs::check(law));
  const auto refused = [](const LuGre& f) -> std::string {
    try {
      block(f, 1);
    } catch (const InvalidArgument& why) {
      return why.what();
    }
    return "(not refused)";
  };
  EXPECT_EQ(refused(less),
            "LuGre friction: viscous is 9, expected bristle_damping (breakaway - coulomb) / "
            "coulomb = 10 or more: with less it would make energy");
  // The least itself is accepted, whatever its rounding: here it is 0.05 + 7e-18.
  LuGre rounded = law;
  rounded.coulomb = 0.3;
  rounded.breakaway = 0.45;
  rounded.bristle_damping = 0.1;
  rounded.viscous = 0.05;
  EXPECT_EQ(refused(rounded), "(not refused)");
  LuGre wrong = law;
  wrong.coulomb = 0;
  EXPECT_NE(refused(wrong).find("coulomb is 0, expected more than 0"), std::string::npos);
  wrong = law;
  wrong.bristle_stiffness = 0;
  EXPECT_NE(refused(wrong).find("bristle_stiffness is 0"), std::string::npos);
  Network n("spring");
  n.add("s", phs::spring_element(phs::spring(1)));
  EXPECT_THROW(n.lugre("rub", "s.ends", law), InvalidArgument);
}

/// Random pushes, with rests and reversals: each step loses, and the balance closes to rounding.
TEST(LuGre, RandomMotionsOnlyLose) {
  std::mt19937_64 generator(11);
  std::normal_distribution<double> normal;
  double least = 1e300, defect = 0;
  for (int motion = 0; motion < 20; ++motion) {
    const double a = 3 * normal(generator), b = 2 * normal(generator), c = normal(generator);
    const auto push = phs::function([=](auto t) {
      using T = decltype(t);
      return T(a) * sin(T(3.0) * t) + T(b) * sin(T(7.1) * t + T(c)) + T(c);
    });
    Motion<> run(block(law, 1, push), {normal(generator), 1e-5}, 1e-3);
    run.steps(3000);
    least = std::min(least, run.least_loss);
    defect = std::max(defect, std::fabs(run.defect()));
  }
  std::printf("  least loss of a step %.1e J (0); balance %.1e J\n", least, defect);
  EXPECT_GE(least, 0);
  EXPECT_LE(defect, 1e-11);
}

/// A block on a slope, at 0.8 of Coulomb's force: it bends by force / σ0 and stays. The control is
/// the smooth law, which creeps on at v_s atanh(0.8).
TEST(LuGre, HoldsWhereTheSmoothLawCreeps) {
  const auto way = [](bool bristle) {
    Network n("slope");
    n.add("mass", phs::inertia_element(1, phs::translation));
    n.add("place", phs::spring_element(phs::spring(0), phs::translation));  // sees how far it goes
    n.feedback("mass.body", "place.ends");
    n.source("weight", "mass.body", phs::constant(0.8));
    if (bristle)
      n.lugre("rub", "mass.body", law);
    else
      n.resist("rub", "mass.body", phs::friction({.coulomb = 1, .smoothing = 1e-4}));
    const auto model = n.build();
    const auto at = size_t(model->offset("place"));
    Motion<> run(model, Numbers(size_t(model->description().nx), 0.0), 0.01);
    run.steps(1000);
    const double early = run.state.x[at];
    run.steps(9000);
    return std::pair{early, run.state.x[at] - early};
  };
  const auto [bent, drift] = way(true);
  const auto [crept, creep] = way(false);
  std::printf("  bends %.6e m, then in 90 s %.1e m (1e-15); creeps %.3e m, by closed form %.3e m\n",
              bent, drift, creep, 90 * 1e-4 * std::atanh(0.8));
  EXPECT_GT(bent, 0.8 / law.bristle_stiffness);
  EXPECT_LE(std::fabs(drift), 1e-15);
  EXPECT_NEAR(creep, 90 * 1e-4 * std::atanh(0.8), 1e-6);
  EXPECT_GT(crept, 0);
}

/// The largest value of a series, by a parabola through the three highest of its samples.
class Peak {
 public:
  void see(double e) {
    if (e > b_ && e >= c_) {
      a_ = c_;
      b_ = e;
      next_ = true;
    } else if (next_) {
      after_ = e;
      next_ = false;
    }
    c_ = e;
  }
  double value() const {
    const double slope = (after_ - a_) / 2, bend = a_ - 2 * b_ + after_;
    return b_ - slope * slope / (2 * bend);
  }

 private:
  double a_ = 0, b_ = 0, c_ = 0, after_ = 0;  ///< before the largest, it, the last, after it
  bool next_ = false;
};

/// The equations as Canudas de Wit and others wrote them, by small steps of the classic method of
/// order 4: a mass of 1 kg under a force that grows by `rate`.
double break_away_by_hand(const LuGre& f, double rate, double h) {
  double v = 0, z = 0;
  Peak peak;
  for (int k = 0; v < 0.02; ++k) {
    peak.see(f.bristle_stiffness * z);
    double dv[4], dz[4], u = v, b = z;
    for (int s = 0; s < 4; ++s) {
      const double c = s == 0 ? 0 : s == 3 ? h : h / 2;
      if (s > 0) {
        u = v + c * dv[s - 1];
        b = z + c * dz[s - 1];
      }
      dz[s] = u - f.bristle_stiffness * std::fabs(u) / slide(f, u) * b;
      const double force = f.bristle_stiffness * b + f.bristle_damping * dz[s] + f.viscous * u;
      dv[s] = rate * (k * h + c) - force;
    }
    v += h / 6 * (dv[0] + 2 * dv[1] + 2 * dv[2] + dv[3]);
    z += h / 6 * (dz[0] + 2 * dz[1] + 2 * dz[2] + dz[3]);
  }
  return peak.value();
}

/// Under a load that grows by 2 to 20 N/s the bristle breaks loose at less force the faster it
/// grows (Canudas de Wit and others 1995, figure 4).
TEST(LuGre, BreaksLooseAtLessForceTheFasterTheLoadGrows) {
  LuGre stiff = law;
  stiff.bristle_stiffness = 1e5;
  stiff.stribeck = 1e-3;
  double before = 1.5, worst = 0;
  for (const double rate : {2.0, 5.0, 10.0, 20.0}) {
    const auto ramp = phs::function([rate](auto t) { return decltype(t)(rate) * t; });
    Motion<> run(block(stiff, 1, ramp), {0, 0}, 1e-4);
    Peak peak;
    while (run.state.x[0] < 0.02) {
      peak.see(stiff.bristle_stiffness * run.state.x[1]);
      ASSERT_TRUE(run.step());
    }
    const double by_hand = break_away_by_hand(stiff, rate, 4e-6);
    std::printf("  %4.0f N/s: %.6f N, by hand %.6f N\n", rate, peak.value(), by_hand);
    worst = std::max(worst, std::fabs(peak.value() - by_hand));
    EXPECT_LT(peak.value(), before);
    before = peak.value();
  }
  EXPECT_LE(worst, 1e-6);
  EXPECT_LT(before, 1.15) << "far below the breakaway force of a slow load";
}

/// A block under A cos(3 t) with soft bristles, for a second: where it ends.
template <class T>
std::vector<T> end_of(double start, double A, int n, const char* method) {
  LuGre soft = law;
  soft.stribeck = soft.viscous = 0.5;
  soft.bristle_stiffness = 10;
  soft.bristle_damping = 1;
  const auto push =
      phs::function([A](auto t) { return decltype(t)(A) * cos(decltype(t)(3.0) * t); });
  Motion<T> run(block(soft, 1, push), {T(start), T(0.0)}, T(1.0) / T(n), method);
  run.steps(n);
  return run.state.x;
}
template <class T>
double apart(const std::vector<T>& a, const std::vector<T>& b) {
  return std::fabs(double(a[0] - b[0])) + std::fabs(double(a[1] - b[1]));
}

/// While the rate keeps its sign the orders are those of the methods, in 113 bits by halved steps.
/// Across reversals, where |v| has a kink, the order is 2.
TEST(LuGre, OrdersOfTheMethods) {
  const auto order = [](const char* method) {
    const auto x = [&](int n) { return end_of<phs::Quad>(3, 0.5, n, method); };
    const auto middle = x(128);
    return std::log2(apart(x(64), middle) / apart(middle, x(256)));
  };
  const auto across = [](int n) {
    double sum = 0;
    for (const double A : {5.0, 5.7, 6.3, 7.1})
      sum += apart(end_of<double>(0.2, A, n, "gauss6"), end_of<double>(0.2, A, 1 << 14, "gauss6"));
    return sum;
  };
  const double o2 = order("midpoint"), o4 = order("gauss4"), o6 = order("gauss6"),
               turned = std::log2(across(32) / across(512)) / 4;
  std::printf("  one way: midpoint %.2f, gauss4 %.2f, gauss6 %.2f; across reversals gauss6 %.2f\n",
              o2, o4, o6, turned);
  EXPECT_NEAR(o2, 2, 0.1);
  EXPECT_NEAR(o4, 4, 0.1);
  EXPECT_NEAR(o6, 6, 0.2);
  EXPECT_NEAR(turned, 2, 0.5);
}

}  // namespace
}  // namespace porthos::test::lugre_test
