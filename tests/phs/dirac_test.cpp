// Dirac structures: both conditions measured, the standard elements, composition over shared ports.
#include "phs/linear/dirac.h"

#include <cmath>
#include <random>

#include "tests/support/bounds.h"

namespace porthos::phs::dirac_test {
namespace {

using test::breaks, test::keeps, test::refusal;

Matrix random_skew(std::mt19937_64& rng, int n) {
  std::normal_distribution<double> number;
  Matrix K(n, n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j) {
      K(i, j) = number(rng);
      K(j, i) = -K(i, j);
    }
  return K;
}
using Vec = std::vector<double>;

TEST(Dirac, TheElementsAre) {
  std::mt19937_64 rng(1);
  double power = 0, independence = 1;
  for (const auto& d : {Dirac::feedback(random_skew(rng, 7)), Dirac::zero_junction(5),
                        Dirac::one_junction(4), Dirac::transformer(17), Dirac::gyrator(0.05)}) {
    power = std::max(power, d.defects().power);
    independence = std::min(independence, d.defects().independence);
  }
  keeps("|F Eᵀ + E Fᵀ| of every element", power, 1e-15);
  breaks("least independence of their rows", independence, 1e-3);
}

TEST(Dirac, TheElementsMeanWhatTheirNamesSay) {
  const auto on = [](const Dirac& d, const Vec& f, const Vec& e) { return d.residual(f, e); };
  keeps("0-junction: one effort", on(Dirac::zero_junction(3), {1, 2, -3}, {5, 5, 5}), 0);
  breaks("0-junction: flows that do not sum to 0",
         on(Dirac::zero_junction(3), {1, 2, 3}, {5, 5, 5}), 0.1);
  keeps("1-junction: one flow", on(Dirac::one_junction(3), {5, 5, 5}, {1, 2, -3}), 0);
  keeps("transformer 4: e1 = 4 e2, f2 = -4 f1", on(Dirac::transformer(4), {3, -12}, {8, 2}), 0);
  breaks("transformer the other way", on(Dirac::transformer(4), {-12, 3}, {8, 2}), 0.1);
  keeps("gyrator 4: e1 = 4 f2, e2 = -4 f1", on(Dirac::gyrator(4), {3, 2}, {8, -12}), 0);
  breaks("gyrator with both signs +", on(Dirac::gyrator(4), {3, 2}, {8, 12}), 0.1);
  keeps("feedback e = K f", on(Dirac::feedback({{0, -1}, {1, 0}}), {3, 2}, {-2, 3}), 0);
}

TEST(Dirac, RefusesWhatMakesPowerOrLeavesPortsOpen) {
  EXPECT_EQ(refusal([] { Dirac(Matrix::identity(2), Matrix::identity(2)); }),
            "not a Dirac structure: |F Eᵀ + E Fᵀ| = 1.41421 |[F|E]|², power is not kept");
  EXPECT_EQ(refusal([] {
              Dirac({{1, 0}, {1, 0}}, {{0, 0}, {0, 0}});
            }),
            "not a Dirac structure: the smallest singular value of [F|E] is 0 of the largest, its "
            "2 rows are not independent");
  EXPECT_EQ(refusal([] { Dirac(Matrix(2, 2), Matrix(2, 1)); }),
            "Dirac structure: F is 2 x 2 and E is 2 x 1, expected both n x n");
  EXPECT_NE(refusal([] { Dirac::feedback({{0, 1}, {-1.001, 0}}); }), "") << "K off skew by 0.1 %";
  EXPECT_NE(refusal([] { Dirac({{NAN}}, {{0}}); }), "");
  const auto lossy = dirac_defects({{1}}, {{-2}});  // e = f/2, a resistor
  breaks("a resistor", lossy.power, 0.1);
}

TEST(Dirac, ResidualMeasuresDistanceFromTheSet) {
  std::mt19937_64 rng(2);
  std::normal_distribution<double> number;
  const auto K = random_skew(rng, 6);
  const auto d = Dirac::feedback(K);
  Vec f(6), e(6);
  double power = 0, size = 0;
  for (double& x : f) x = number(rng);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) e[size_t(i)] += K(i, j) * f[size_t(j)];
    power += e[size_t(i)] * f[size_t(i)];
    size += std::fabs(e[size_t(i)] * f[size_t(i)]);
  }
  keeps("(f, K f): residual", d.residual(f, e), 1e-15);
  keeps("(f, K f): power over its terms", std::fabs(power) / size, 1e-15);
  e[0] += 1;
  breaks("one effort moved by 1", d.residual(f, e), 0.1);
}

// --- composition ---------------------------------------------------------------------------------

TEST(DiracComposition, OfTransformersAndGyrators) {
  const auto joined = [](const Dirac& a, const Dirac& b) { return compose(a, b, {{1, 0}}); };
  const auto T = [](double n) { return Dirac::transformer(n); };
  const auto G = [](double r) { return Dirac::gyrator(r); };
  keeps("gears 3 and 5 are a gear 15", distance(joined(T(3), T(5)), T(15)), 1e-15);
  breaks("... and not 15.001", distance(joined(T(3), T(5)), T(15.001)), 1e-7);
  // e1 = 2 f2 = -2 f1', and f1' = -e2'/6.
  keeps("motors 2 and 6: e1 = (2/6) e3", distance(joined(G(2), G(6)), T(2.0 / 6)), 1e-15);
  keeps("a motor 2 behind a gear 3 is a motor 6", distance(joined(T(3), G(2)), G(6)), 1e-15);
  breaks("... and not -6", distance(joined(T(3), G(2)), G(-6)), 1e-2);
}

TEST(DiracComposition, OfJunctions) {
  const auto N = [](int n) { return Dirac::zero_junction(n); };
  keeps("nodes of 4 and 3 wires by one: a node of 5", distance(compose(N(4), N(3), {{3, 0}}), N(5)),
        1e-15);
  keeps("by two wires, a loop with one equation too many: a node of 3",
        distance(compose(N(4), N(3), {{2, 0}, {3, 1}}), N(3)), 1e-15);
  breaks("a node is no loop", distance(N(3), Dirac::one_junction(3)), 1e-2);
  const auto apart = compose(N(2), Dirac::gyrator(2), {});
  EXPECT_EQ(apart.ports(), 4);
  EXPECT_LE(apart.residual(Vec{1, -1, 3, 2}, Vec{7, 7, 4, -6}), 1e-15);
}

TEST(DiracComposition, OfRandomStructuresIsDirac) {
  std::mt19937_64 rng(4);
  double power = 0, independence = 1, associative = 0;
  for (int i = 0; i < 100; ++i) {
    const auto a = Dirac::feedback(random_skew(rng, 3 + i % 4));
    const auto b = Dirac::feedback(random_skew(rng, 4 + i % 3));
    const auto c = Dirac::feedback(random_skew(rng, 3));
    const auto ab = compose(a, b, {{0, 2}, {2, 1}});
    EXPECT_EQ(ab.ports(), a.ports() + b.ports() - 4);
    power = std::max(power, ab.defects().power);
    independence = std::min(independence, ab.defects().independence);
    // a's port 1 is the first one left of a∘b; b's port 3 comes after those of a.
    const auto left = compose(compose(a, b, {{0, 0}}), c, {{a.ports() - 1 + 2, 1}});
    const auto right = compose(a, compose(b, c, {{3, 1}}), {{0, 0}});
    associative = std::max(associative, distance(left, right));
  }
  keeps("|F Eᵀ + E Fᵀ| of 100 compositions", power, 1e-13);
  breaks("least independence of their rows", independence, 0.5);
  keeps("(a∘b)∘c against a∘(b∘c)", associative, 1e-13);
}

TEST(DiracComposition, KeepsWhatItsPartsKeep) {
  std::mt19937_64 rng(9);
  std::normal_distribution<double> number;
  const auto A = random_skew(rng, 3), B = random_skew(rng, 3);
  const auto both = compose(Dirac::feedback(A), Dirac::feedback(B), {{2, 0}});
  // The shared flow s into a is free; A(2,:)(f0, f1, s) = B(0,:)(-s, g1, g2), without s as both are
  // skew, gives g2.
  const double f0 = number(rng), f1 = number(rng), g1 = number(rng), s = number(rng);
  const double g2 = (A(2, 0) * f0 + A(2, 1) * f1 - B(0, 1) * g1) / B(0, 2);
  const Vec f{f0, f1, g1, g2};
  const auto efforts = [&](double inner) {
    return Vec{A(0, 1) * f1 + A(0, 2) * inner, A(1, 0) * f0 + A(1, 2) * inner,
               -B(1, 0) * inner + B(1, 2) * g2, -B(2, 0) * inner + B(2, 1) * g1};
  };
  keeps("flows and efforts of the parts lie on it", both.residual(f, efforts(s)), 1e-14);
  auto wrong = efforts(s);
  wrong[2] += 2 * B(1, 0) * s;
  wrong[3] += 2 * B(2, 0) * s;
  breaks("with the shared flow not turned round", both.residual(f, wrong), 1e-2);
}

TEST(DiracComposition, RefusesPortsThatAreNotThere) {
  const auto t = Dirac::transformer(2);
  EXPECT_EQ(refusal([&] {
              compose(t, t, {{2, 0}});
            }),
            "compose: the first structure has no port 2, only 0 to 1");
  EXPECT_EQ(refusal([&] {
              compose(t, t, {{0, 1}, {1, 1}});
            }),
            "compose: port 1 of the second structure is shared twice");
  EXPECT_EQ(refusal([&] { compose(t, t, {{0, 0}, {1, 1}}); }), "compose: no port is left");
}

}  // namespace
}  // namespace porthos::phs::dirac_test
