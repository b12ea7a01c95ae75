// The rows of loop joints, rods and couplings against derivatives, their Delassus matrix against
// the dense one, in every scalar.
#include <gtest/gtest.h>

#include <cmath>

#include "mechanics/constraints/projection.h"
#include "mechanics/crba.h"
#include "mechanics/kinematics.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "phs/system/reactions.h"
#include "tests/support/linkages.h"
#include "tests/support/random_tree.h"

namespace porthos::mechanics::constraint_rows_test {
namespace {

using Vec = std::vector<double>;

const std::vector<std::string> loop_types{"revolute", "continuous", "prismatic", "cylindrical",
                                          "helical",  "spherical",  "universal", "planar",
                                          "fixed",    "disk",       "sphere",    "blade",
                                          "no_spin",  "on_plane",   "on_line",   "on_curve"};
bool rolls(const std::string& type) {
  return type == "disk" || type == "sphere" || type == "blade" || type == "no_spin";
}

/// Two branches from a root, closed by every kind of loop joint at random frames, a rod to the
/// world and a coupling.
struct Looped {
  std::shared_ptr<const Mechanism> mechanism;
  ConstraintSpec spec;
  Vec q, v;
};
Looped looped(const std::string& type, std::uint64_t seed, const std::string& root = "free") {
  test::RandomTree random(seed);
  MechanismBuilder b("looped");
  const char* joints[] = {"revolute", "spherical", "prismatic", "cylindrical",
                          "revolute", "universal", "helical",   "revolute"};
  b.add(random.body(0, "world", root));
  for (int i = 1; i < 9; ++i)
    b.add(random.body(i, "body_" + std::to_string(i < 3 ? 0 : i - 2), joints[i - 1]));
  Looped l{std::make_shared<Mechanism>(b.build()), {}, {}, {}};
  const LinkFrame on_a{"body_7", random.pose()}, on_b{"body_8", random.pose()};
  if (rolls(type))
    l.spec.rollings.push_back({"loop", type, on_a, on_b, 0.4});
  else
    l.spec.loops.push_back({"loop", type, on_a, on_b, 0.2});
  if (type == "on_curve") {
    l.spec.loops[0].points = {{2, 0}, {1, 2}, {-2, 1}, {-1, -2}};
    l.spec.loops[0].closed = true;
  }
  l.spec.rods.push_back({"rod", {"body_5", random.pose()}, {"", random.pose()}, 0.7});
  l.spec.couplings.push_back({"gear", {{"joint_1", 2}, {"joint_3", -0.5}}, 0.1});
  l.q = random.q(*l.mechanism);
  l.v = random.numbers(l.mechanism->nv());
  return l;
}

template <class T>
std::vector<T> as(const Vec& x) {
  return {x.begin(), x.end()};
}
double largest(const Vec& x) {
  double most = 0;
  for (const double c : x) most = std::max(most, std::fabs(c));
  return most;
}

TEST(ConstraintRows, RatesAreTheDerivativesOfRows) {
  double worst = 0;
  for (const auto& type : loop_types)
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const Looped l = looped(type, seed);
      const ConstraintSet set(*l.mechanism, l.spec);
      const size_t nq = size_t(l.mechanism->nq()), m = size_t(set.count());
      std::vector<phs::Dual> x(2 * nq, phs::Dual(0.0)), g(m), rate(m), e(2 * nq, phs::Dual(0.0));
      Vec q_dot(nq);
      coordinate_rates<double>(*l.mechanism, l.q, l.v, q_dot);
      for (size_t i = 0; i < nq; ++i) {
        x[i] = {l.q[i], q_dot[i]};
        e[nq + i] = phs::Dual(q_dot[i]);
      }
      const auto rows = make_constraints<phs::Dual>(*l.mechanism, set);
      rows->place(x, g);
      rows->rates(e, rate);
      const auto only_rolls = [&](int row) {  // but the first of a disk or sphere, its height
        const auto& b = set.blocks()[1];
        return b.rolling && row >= b.at + (b.size == 3) && row < b.at + b.size;
      };
      for (size_t r = 0; r < m; ++r) {
        if (only_rolls(int(r))) {
          EXPECT_EQ(g[r].v, 0) << type;
          continue;
        }
        const double error = std::fabs(g[r].d - rate[r].v);
        worst = std::max(worst, error);
        // Where rows steepen, 4.7e-13 of a weld near half a turn, 1.7e-12 of a disk that lies
        // nearly flat; 1e-14 elsewhere.
        EXPECT_LT(error, 1e-11) << type << " row " << r;
      }
    }
  std::printf("  rates of rows against duals: %.1e\n", worst);
}

TEST(ConstraintRows, ForcesAreTheTransposeOfRates) {
  for (const auto& type : loop_types) {
    const Looped l = looped(type, 11);
    const ConstraintSet set(*l.mechanism, l.spec);
    const size_t nq = size_t(l.mechanism->nq()), m = size_t(set.count());
    test::RandomTree random(3);
    Vec x = l.q, e = random.numbers(int(2 * nq)), lambda = random.numbers(int(m)), g(m), rate(m),
        force(2 * nq);
    x.resize(2 * nq);
    const auto rows = make_constraints<double>(*l.mechanism, set);
    rows->place(x, g);
    rows->rates(e, rate);
    rows->forces(lambda, force);
    double a = 0, b = 0;
    for (size_t r = 0; r < m; ++r) a += lambda[r] * rate[r];
    for (size_t i = 0; i < 2 * nq; ++i) b += force[i] * e[i];
    EXPECT_NEAR(a, b, 1e-13 * (1 + std::fabs(a))) << type;
  }
}

/// D = G M⁻¹ Gᵀ from the dense mass matrix, row-major.
Vec dense_delassus(const Looped& l, const ConstraintSet& set) {
  const Mechanism& mechanism = *l.mechanism;
  const size_t nq = size_t(mechanism.nq()), nv = size_t(mechanism.nv()), m = size_t(set.count());
  Workspace<double> w(mechanism);
  Vec M(nv * nv), G(m * nv), g(m), x = l.q;
  crba<double>(mechanism, w, l.q, M);
  x.resize(2 * nq);
  const auto rows = make_constraints<double>(mechanism, set);
  rows->place(x, g);
  for (size_t k = 0; k < nv; ++k) {
    Vec unit(nv, 0.0), e(2 * nq, 0.0);
    unit[k] = 1;
    coordinate_rates<double>(mechanism, l.q, unit, std::span(e).subspan(nq));
    rows->rates(e, g);
    for (size_t r = 0; r < m; ++r) G[r * nv + k] = g[r];
  }
  Vec D(m * m, 0.0);
  for (size_t s = 0; s < m; ++s) {
    const Vec y = phs::linear_solve(nv, M, std::span(G).subspan(s * nv, nv));
    for (size_t r = 0; r < m; ++r)
      for (size_t k = 0; k < nv; ++k) D[r * m + s] += G[r * nv + k] * y[k];
  }
  return D;
}

TEST(ConstraintRows, DelassusMatrixIsTheDenseOne) {
  double worst = 0;
  for (const auto& type : loop_types)
    for (const char* root : {"free", "revolute", "spherical"}) {
      const Looped l = looped(type, 21, root);
      const ConstraintSet set(*l.mechanism, l.spec);
      const size_t m = size_t(set.count());
      Vec x = l.q, g(m), D(m * m);
      x.resize(2 * x.size());
      const auto rows = make_constraints<double>(*l.mechanism, set);
      rows->place(x, g);
      rows->delassus(x, D);
      const Vec expected = dense_delassus(l, set);
      for (size_t i = 0; i < D.size(); ++i) {
        const double error = std::fabs(D[i] - expected[i]) / largest(expected);
        worst = std::max(worst, error);
        EXPECT_LT(error, 1e-13) << type << " on a " << root << " root, element " << i;
      }
    }
  std::printf("  Delassus matrix against G M^-1 G^T: %.1e\n", worst);
}

void expect_lanes_like_scalars(const std::string& type) {
  const Looped l = looped(type, 31);
  const ConstraintSet set(*l.mechanism, l.spec);
  const size_t nq = size_t(l.mechanism->nq()), m = size_t(set.count());
  using Pack = phs::Pack8;
  std::vector<Pack> x(2 * nq), g(m), lambda(m), force(2 * nq), D(m * m);
  std::vector<Vec> each(8);
  test::RandomTree random(5);
  const Vec mu = random.numbers(int(m));
  for (int lane = 0; lane < 8; ++lane) {
    each[size_t(lane)] = random.q(*l.mechanism);
    each[size_t(lane)].resize(2 * nq);
    for (size_t k = 0; k < 2 * nq; ++k) x[k].set(lane, each[size_t(lane)][k]);
  }
  for (size_t r = 0; r < m; ++r) lambda[r] = Pack(mu[r]);
  const auto rows = make_constraints<Pack>(*l.mechanism, set);
  rows->place(x, g);
  rows->forces(lambda, force);
  rows->delassus(x, D);
  EXPECT_THROW(rows->factor(x), std::logic_error);
  const auto one = make_constraints<double>(*l.mechanism, set);
  for (int lane = 0; lane < 8; ++lane) {
    Vec g1(m), f1(2 * nq), D1(m * m);
    one->place(each[size_t(lane)], g1);
    one->forces(mu, f1);
    one->delassus(each[size_t(lane)], D1);
    for (size_t r = 0; r < m; ++r) EXPECT_EQ(g1[r], g[r][lane]);
    for (size_t k = 0; k < 2 * nq; ++k) EXPECT_EQ(f1[k], force[k][lane]);
    for (size_t i = 0; i < m * m; ++i) EXPECT_EQ(D1[i], D[i][lane]);
  }
}
TEST(ConstraintRows, LanesAreTheScalarBits) {
  for (const char* type : {"universal", "on_plane", "on_line", "on_curve"}) {
    SCOPED_TRACE(type);
    expect_lanes_like_scalars(type);
  }
}

/// A loop between two links of a free-flyer pushes its base by nothing at all, not even rounding.
TEST(ConstraintRows, InnerLoopsLeaveTheBaseAlone) {
  Looped l = looped("revolute", 41);
  l.spec.rods.clear();
  const ConstraintSet set(*l.mechanism, l.spec);
  const size_t nq = size_t(l.mechanism->nq());
  Vec x = l.q, g(size_t(set.count())), force(2 * nq);
  x.resize(2 * nq);
  const auto rows = make_constraints<double>(*l.mechanism, set);
  rows->place(x, g);
  rows->forces(Vec(g.size(), 1.0), force);
  for (size_t k = 0; k < 7; ++k) EXPECT_EQ(force[nq + k], 0) << k;
  EXPECT_GT(largest(force), 0.1);
}

/// The pin of a planar four-bar in space: five rows, of which one position along the axis and two
/// turns depend on nothing here.
TEST(ConstraintRows, DependentRowsAreFoundOnTheManifold) {
  auto l = test::four_bar();
  const auto x = l.start();
  const auto model = l.model();
  const auto system = model.instantiate<double>();
  const auto rows = system->constraints();
  Vec g(5);
  rows->place(x, g);
  EXPECT_LT(largest(g), 1e-15);
  EXPECT_EQ(rows->factor(x), 2);
  EXPECT_TRUE(rows->uses(0) && rows->uses(1));
  EXPECT_TRUE(rows->unique(0) && rows->unique(1));
  for (int r = 2; r < 5; ++r) EXPECT_FALSE(rows->uses(r) || rows->unique(r)) << r;
  // Two rods in parallel share a force: dependent, and neither is unique.
  l.spec.loops.clear();
  l.spec.rods = {{"one", test::at("coupler", 1.5, 0), test::at("", 1.5, 0), 1.25},
                 {"two", test::at("coupler", 1.5, 0), test::at("", 1.5, 0), 1.25}};
  const auto rods = l.model();
  const auto system_of_rods = rods.instantiate<double>();
  const auto twice = system_of_rods->constraints();
  Vec g2(2);
  twice->place(x, g2);
  EXPECT_LT(largest(g2), 1e-15);
  EXPECT_EQ(twice->factor(x), 1);
  EXPECT_FALSE(twice->unique(0) || twice->unique(1));
  Vec lambda{3, 3};
  twice->solve(lambda);
  EXPECT_EQ(lambda[1], 0);
  const double all = lambda[0];
  twice->shorten(lambda);
  EXPECT_NEAR(lambda[0], all / 2, 1e-14);
  EXPECT_NEAR(lambda[1], all / 2, 1e-14);
}

/// A gear that ran for a thousand turns closes to the rounding of its wrapped angles.
TEST(ConstraintRows, CouplingsCountTurnsExactly) {
  MechanismBuilder b("gear");
  b.add(test::rod("a", "world", 0, 0, 1, 1)).add(test::rod("b", "world", 2, 0, 1, 1));
  const Mechanism m = b.build();
  const ConstraintSet set(m, {{}, {}, {{"mesh", {{"a_joint", 3}, {"b_joint", 1}}, 0.25}}});
  const auto rows = make_constraints<double>(m, set);
  const std::vector<double> turns{1051, -3153};  // 3 * 1051 - 3153 = 0
  const std::vector<double> angles{turns[0] * phs::two_pi_hi, turns[1] * phs::two_pi_hi};
  rows->set_turn_angles(angles);
  Vec g(1);
  rows->place(Vec{0.125, -0.125, 0, 0}, g);
  EXPECT_EQ(g[0], 0);
  // Control: the same with the turns in the angles loses four digits.
  rows->set_turn_angles(Vec{0, 0});
  rows->place(Vec{0.1 + angles[0], -0.05 + angles[1], 0, 0}, g);
  EXPECT_GT(std::fabs(g[0]), 1e-13);
  EXPECT_LT(std::fabs(g[0]), 1e-10);
}

/// A rod's row in one word is off by the rounding of l²; in two words only by that of d.
TEST(ConstraintRows, RodsAreSubtractedInTwoWords) {
  MechanismBuilder b("point");
  BodySpec body = test::rod("mass", "world", 0, 0, 1, 1);
  body.joint.type = "planar";
  b.add(body);
  const Mechanism m = b.build();
  const double l = 5.1;
  const ConstraintSet set(m, {{}, {{"rod", {"mass"}, {""}, l}}, {}});
  const auto rows = make_constraints<double>(m, set);
  const auto exact = make_constraints<phs::Quad>(m, set);
  double worst = 0, control = 0;
  for (int i = 0; i < 100; ++i) {
    Vec x = m.neutral(), g(1);
    x[0] = l * std::cos(0.1 * i);
    x[1] = l * std::sin(0.1 * i);
    x.resize(2 * x.size());
    rows->place(x, g);
    std::vector<phs::Quad> g4(1);
    exact->place(as<phs::Quad>(x), g4);
    worst = std::max(worst, std::fabs(g[0] - double(g4[0])));
    control =
        std::max(control, std::fabs((x[0] * x[0] + x[1] * x[1] - l * l) / (2 * l) - double(g4[0])));
  }
  std::printf("  rod: %.1e, in one word %.1e\n", worst, control);
  EXPECT_LT(worst, 1e-31);
  EXPECT_GT(control, 1e-16);
}

}  // namespace
}  // namespace porthos::mechanics::constraint_rows_test
