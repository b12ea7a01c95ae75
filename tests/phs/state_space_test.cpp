// Positive realness and available storage judged from (E, A, B, C, D) alone, against the structure
// and closed forms.
#include "phs/linear/state_space.h"

#include "tests/support/bounds.h"
#include "tests/support/linear_benchmarks.h"

namespace porthos::phs::state_space_test {
namespace {

using test::breaks, test::keeps;

/// (b0 + b1 s + ... + d sⁿ)/(a0 + ... + sⁿ) in companion form: C = b - d a.
StateSpace rational(std::vector<double> b, std::vector<double> a, double d) {
  const int n = int(a.size());
  StateSpace g{Matrix::identity(n), {n, n}, {n, 1}, {1, n}, {{d}}};
  for (int i = 0; i < n; ++i) {
    if (i + 1 < n) g.A(i, i + 1) = 1;
    g.A(n - 1, i) = -a[size_t(i)];
    g.C(0, i) = b[size_t(i)] - d * a[size_t(i)];
  }
  g.B(n - 1, 0) = 1;
  return g;
}

// --- positive realness ---------------------------------------------------------------------------

TEST(PositiveReality, OfEveryPortHamiltonianSystem) {
  std::mt19937_64 rng(7);
  double worst = 0, above_grid = 0, pole = -INFINITY;
  for (int i = 0; i < 100; ++i) {
    const LinearSystem system(test::random_matrices(rng, 1 + i % 6, 1 + i % 3));
    const auto g = system.state_space();
    const auto p = system.positive_real();
    EXPECT_TRUE(p.holds()) << "system " << i;
    EXPECT_GT(system.dissipation(), 0);
    worst = std::max(worst, -p.minimum.value);
    pole = std::max(pole, p.rightmost_pole);
    if (system.ports() > 1) continue;
    for (double omega = 1e-3; omega < 1e3; omega *= 1.02) {  // no frequency lies lower
      const double value = 2 * transfer(g, {0, omega})(0, 0).real();
      above_grid = std::max(above_grid, (p.minimum.value - value) / p.minimum.size);
    }
  }
  keeps("100 random systems, -min λ(T + T*)", worst, 0);
  keeps("their rightmost pole", pole, 0);
  keeps("minimum above that of a grid, one port", above_grid, 1e-12);
}

TEST(PositiveReality, DecidesOnTheEdge) {
  std::mt19937_64 rng(8);
  double worst = 0;
  int passed = 0;
  for (int i = 0; i < 60;
       ++i) {  // T + T* has at most the rank 1 of W: with two ports min λ = 0 everywhere
    const LinearSystem system(test::random_matrices(rng, 1 + i % 6, 2, 1));
    const auto p = system.positive_real();
    EXPECT_TRUE(p.holds()) << "system " << i << ": " << p.minimum.value << ", limit " << p.limit;
    worst = std::max(worst, std::fabs(p.minimum.value) / p.minimum.size);
    auto active = system.state_space();
    active.D(0, 0) -= 1e-8 * p.minimum.size;
    active.D(1, 1) -= 1e-8 * p.minimum.size;
    passed += positive_reality(active).holds();
  }
  keeps("W of rank 1, two ports: |min λ(T + T*)| over its terms", worst, 1e-11);
  EXPECT_EQ(passed, 0) << "1e-8 below the edge";
}

TEST(PositiveReality, OfTheBenchmarks) {
  for (const auto& system :
       {test::mass_spring_damper_chain(12), test::rcl_ladder(12), test::DcMotor{}.system(),
        test::rcl_ladder(12, 0, 0), test::rcl_ladder(50)}) {
    const auto p = system.positive_real();
    std::printf("  %-24s min λ(T + T*) = %.2e at ω = %.3g, σ = %.2g, limit %.1e, %d transfers\n",
                system.name().c_str(), p.minimum.value, p.minimum.omega, p.sigma, p.limit,
                p.minimum.evaluations);
    EXPECT_TRUE(p.holds()) << system.name();
    auto broken =
        system.state_space();  // a negative resistance of a millionth in series with the port
    broken.D(0, 0) -= 1e-6;
    EXPECT_FALSE(positive_reality(broken).holds()) << system.name();
  }
}

TEST(PositiveReality, OfDescriptorSystems) {
  // A capacitor driven by its voltage: T = sC, improper, on the line Re s = σ exactly 2σC.
  const LinearSystem improper({.E = {{3, 0}, {0, 0}}, .J = {{0, 1}, {-1, 0}}, .G = {{0}, {1}}},
                              "T = 3s");
  const auto low = lowest_hermitian_part(improper.state_space(), 0.5);
  keeps("T = 3s: min λ(T + T*) on Re s = 0.5 is 3", std::fabs(low.value - 3), 1e-12);
  EXPECT_TRUE(improper.positive_real().holds());
  auto negative = improper.state_space();
  for (double& c : negative.C.a) c = -c;
  EXPECT_LT(lowest_hermitian_part(negative, 0.5).value, -2.9);
}

TEST(PositiveReality, FindsADipThatAGridMisses) {
  // T = 1 - c s/(s² + 2ζ s + 1) dips to 1 - c/2ζ at ω = 1, over a band of width ζ.
  const double zeta = 1e-6, depth = 1e-3, c = 2 * zeta * (1 + depth);
  const auto dip = rational({1, 2 * zeta - c}, {1, 2 * zeta}, 1);
  double grid = INFINITY;
  for (int i = 0; i < 100000; ++i) {
    const double omega = std::pow(10, -3 + 6 * (i + 0.5) / 100000);
    grid = std::min(grid, 2 * transfer(dip, {0, omega})(0, 0).real());
  }
  const auto p = positive_reality(dip);
  std::printf("  100 000 frequencies: min %.4f; level sets: %.6e at ω = %.9f, %d transfers\n", grid,
              p.minimum.value, p.minimum.omega, p.minimum.evaluations);
  keeps("minimum against its formula -2·depth", std::fabs(p.minimum.value + 2 * depth), 1e-9);
  EXPECT_FALSE(p.holds());
  EXPECT_GT(grid, 0) << "the control must miss it";
  const auto shallow = rational({1, 2 * zeta - 2 * zeta * (1 - depth)}, {1, 2 * zeta}, 1);
  EXPECT_TRUE(positive_reality(shallow).holds()) << "the same dip, ending above 0";
}

TEST(PositiveReality, RefusesWhatOnlyTheAxisWouldPass) {
  const auto unstable = rational({-1}, {-1}, 0);  // -1/(s - 1): T + T* = 2/(1 + ω²) on the axis
  EXPECT_GT(lowest_hermitian_part(unstable).value, -1e-12);
  EXPECT_NEAR(positive_reality(unstable).rightmost_pole, 1, 1e-12);
  EXPECT_FALSE(positive_reality(unstable).holds());
  for (const double residue : {1.0, -1.0}) {  // ±s/(s² + 4): T + T* = 0 on the axis
    const auto p = positive_reality(rational({0, residue}, {4, 0}, 0));
    std::printf("  %+.0f s/(s² + 4): min λ(T + T*) = %.2e on Re s = %.1e\n", residue,
                p.minimum.value, p.sigma);
    EXPECT_EQ(p.holds(), residue > 0);
  }
  EXPECT_TRUE(positive_reality(rational({1}, {0}, 0)).holds()) << "1/s";
  EXPECT_FALSE(positive_reality(rational({1, 0}, {0, 0}, 0)).holds()) << "1/s²";
}

// --- available storage ---------------------------------------------------------------------------

TEST(AvailableStorage, OfOneStateIsTheFormula) {
  // x' = -r x + u, y = x + s u: X² - 2(1 + 2rs) X + 1 = 0, the smaller root.
  for (const auto& [r, s] : {std::pair{1.0, 1.0}, {0.1, 0.2}, {5.0, 3.0}}) {
    const LinearSystem system({.J = {{0}}, .R = {{r}}, .G = {{1}}, .S = {{s}}});
    const double a = 1 + 2 * r * s, root = 1 / (a + std::sqrt(a * a - 1));
    const double x[] = {2.0};
    const auto storage = system.available_storage(x);
    EXPECT_TRUE(storage.exact) << storage.remark;
    keeps("available over ½ X x², one state", std::fabs(storage.bound / (2 * root) - 1), 1e-13);
    breaks("the larger root", std::fabs(storage.bound * root / 2 - 1), 1e-2);
  }
}

/// Energy that u = gain·D⁻¹(BᵀX - C)x/2, the best law at gain 1, draws from x at the one port until
/// t = 60.
double drawn(const StateSpace& g, const Matrix& X, std::vector<double> x, double gain) {
  const size_t n = x.size();
  std::vector<double> k(n), dx(n), mid(n);
  for (size_t j = 0; j < n; ++j) {
    k[j] = -g.C(0, int(j));
    for (size_t i = 0; i < n; ++i) k[j] += g.B(int(i), 0) * X(int(i), int(j));
    k[j] *= gain / (2 * g.D(0, 0));
  }
  const auto rate = [&](const std::vector<double>& at, std::vector<double>& out) {  // returns -yᵀu
    double u = 0, y = 0;
    for (size_t i = 0; i < n; ++i) {
      u += k[i] * at[i];
      y += g.C(0, int(i)) * at[i];
    }
    for (size_t i = 0; i < n; ++i) {
      out[i] = g.B(int(i), 0) * u;
      for (size_t j = 0; j < n; ++j) out[i] += g.A(int(i), int(j)) * at[j];
    }
    return -(y + g.D(0, 0) * u) * u;
  };
  const double h = 1e-3;
  double energy = 0;
  std::vector<double> sum(n);
  for (int step = 0; step < 60000; ++step) {  // the classical Runge-Kutta method
    double power = rate(x, dx);
    sum = dx;
    for (const double w : {2.0, 2.0, 1.0}) {
      for (size_t i = 0; i < n; ++i) mid[i] = x[i] + (w == 1 ? h : h / 2) * dx[i];
      power += w * rate(mid, dx);
      for (size_t i = 0; i < n; ++i) sum[i] += w * dx[i];
    }
    energy += h / 6 * power;
    for (size_t i = 0; i < n; ++i) x[i] += h / 6 * sum[i];
  }
  return energy;
}

TEST(AvailableStorage, CanBeDrawnAndNotMore) {
  const LinearSystem system({.J = {{0, 1, 0}, {-1, 0, 2}, {0, -2, 0}},
                             .R = {{0.2, 0, 0}, {0, 0.5, 0}, {0, 0, 0.3}},
                             .Q = {{2, 0, 0}, {0, 1, 0.3}, {0, 0.3, 1.5}},
                             .G = {{1}, {0.5}, {0}},
                             .S = {{0.7}}});
  const auto g = system.state_space();
  const auto X = smallest_storage(g);
  ASSERT_TRUE(X);
  const std::vector<double> x{1, -0.5, 2};
  const auto storage = system.available_storage(x);
  const double H = system.hamiltonian(x), best = drawn(g, *X, x, 1);
  std::printf("  H = %.6f, available %.6f, drawn %.6f\n", H, storage.bound, best);
  keeps("drawn by the best law", std::fabs(best / storage.bound - 1), 1e-9);
  EXPECT_LT(storage.bound, H);
  for (const double gain : {0.8, 1.2})
    breaks("less by gain " + std::to_string(gain), 1 - drawn(g, *X, x, gain) / storage.bound, 1e-3);
}

TEST(AvailableStorage, LiesBetweenZeroAndH) {
  std::mt19937_64 rng(11);
  std::normal_distribution<double> number;
  double least = INFINITY, most = 0;
  for (int i = 0; i < 100; ++i) {
    const LinearSystem system(test::random_matrices(rng, 1 + i % 6, 1 + i % 3));
    std::vector<double> x(size_t(system.states()));
    for (double& v : x) v = number(rng);
    const auto storage = system.available_storage(x);
    ASSERT_TRUE(storage.exact) << "system " << i;
    const double share = storage.bound / system.hamiltonian(x);
    least = std::min(least, share);
    most = std::max(most, share);
  }
  std::printf("  available/H of 100 random systems: %.2e to %.4f\n", least, most);
  EXPECT_GT(least, 0);
  EXPECT_LT(most, 1);
}

TEST(AvailableStorage, IsBoundedByHWhereTheRiccatiEquationFails) {
  const double x[] = {1, 2};
  const auto without_feedthrough = test::DcMotor{}.system().available_storage(x);
  EXPECT_FALSE(without_feedthrough.exact);
  EXPECT_EQ(without_feedthrough.bound, test::DcMotor{}.system().hamiltonian(x));
  const LinearSystem lossless(
      {.J = {{0, 1}, {-1, 0}}, .G = {{1, 0}, {0, 0}}, .S = {{1, 0}, {0, 1}}});
  const auto all = lossless.available_storage(x);
  EXPECT_EQ(all.bound, lossless.hamiltonian(x)) << "a lossless circuit gives all it has";
  EXPECT_NE(all.remark.find("H bounds what can be drawn"), std::string::npos);
}

}  // namespace
}  // namespace porthos::phs::state_space_test
