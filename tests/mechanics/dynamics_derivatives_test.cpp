// Derivatives of inverse and forward dynamics: against duals on trees of every joint, lanes, and a
// torque-driven pendulum in closed form.
#include "mechanics/derivatives/dynamics_derivatives.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mechanics/aba.h"
#include "mechanics/kinematics.h"
#include "mechanics/rnea.h"
#include "tests/support/bounds.h"
#include "tests/support/random_tree.h"

namespace porthos::mechanics::dynamics_derivatives_test {
namespace {

using phs::Dual;
using test::breaks;
using test::keeps;
using Vec = std::vector<double>;

template <class T>
std::vector<T> as(const Vec& x) {
  return {x.begin(), x.end()};
}
std::vector<Force<Dual>> as_duals(const std::vector<Force<double>>& f) {
  std::vector<Force<Dual>> out;
  for (const auto& w : f) out.push_back({Vec3<Dual>(w.n), Vec3<Dual>(w.f)});
  return out;
}

/// A tree at a configuration, rates, and what is given of accelerations and forces.
struct Case {
  std::shared_ptr<const Mechanism> m;
  Vec q, v, given;
  std::vector<Force<double>> wrench;
  size_t nv() const { return v.size(); }
};
Case random_case(const std::string& root, std::uint64_t seed) {
  test::RandomTree random(seed);
  random.rotor = seed % 2 ? 0.1 : 0;
  Case c;
  c.m = random.tree(9, root, "", {1, 2, -9.81});
  c.q = random.q(*c.m);
  for (Vec* v : {&c.v, &c.given}) {
    v->resize(size_t(c.m->nv()));
    for (double& x : *v) x = random.uniform(-1, 1);
  }
  for (int i = 0; i < c.m->body_count(); ++i)
    c.wrench.push_back({random.vector(3), random.vector(3)});
  return c;
}

/// Values, and matrices column by column.
struct Derivatives {
  Vec value, dq, dv, dtau;
};
template <bool forward>
Derivatives closed(const Case& c) {
  Workspace<double> w(*c.m);
  DerivativeWorkspace<double> d(*c.m);
  const size_t n = c.nv();
  Derivatives out{Vec(n), Vec(n * n), Vec(n * n), Vec(n * n)};
  if constexpr (forward)
    aba_derivatives<double>(*c.m, w, d, c.q, c.v, {c.given, c.wrench}, out.value, out.dq, out.dv,
                            out.dtau);
  else
    rnea_derivatives<double>(*c.m, w, d, c.q, c.v, c.given, c.wrench, out.value, out.dq, out.dv);
  return out;
}
/// One column after another, by duals along the twist of each freedom.
template <bool forward>
Derivatives by_duals(const Case& c) {
  Workspace<Dual> w(*c.m);
  const size_t n = c.nv();
  const auto wrench = as_duals(c.wrench);
  Derivatives out{Vec(n), Vec(n * n), Vec(n * n), Vec(n * n)};
  const auto column = [&](Vec Derivatives::*to, size_t j, const std::vector<Dual>& q,
                          const std::vector<Dual>& v, const std::vector<Dual>& given) {
    std::vector<Dual> y(n);
    if constexpr (forward)
      aba<Dual>(*c.m, w, q, v, {given, wrench}, y);
    else
      rnea<Dual>(*c.m, w, q, v, given, wrench, y);
    for (size_t i = 0; i < n; ++i) {
      out.value[i] = y[i].v;
      (out.*to)[i + n * j] = y[i].d;
    }
  };
  for (size_t j = 0; j < n; ++j) {
    auto q = as<Dual>(c.q), v = as<Dual>(c.v), given = as<Dual>(c.given);
    Vec e(n, 0.0), along(c.q.size());
    e[j] = 1;
    coordinate_rates<double>(*c.m, c.q, e, along);
    for (size_t i = 0; i < q.size(); ++i) q[i].d = along[i];
    column(&Derivatives::dq, j, q, v, given);
    v[j].d = 1;
    column(&Derivatives::dv, j, as<Dual>(c.q), v, given);
    given[j].d = 1;
    column(&Derivatives::dtau, j, as<Dual>(c.q), as<Dual>(c.v), given);
  }
  return out;
}
/// Largest |a - b| over the largest |b|.
double off(const Vec& a, const Vec& b) {
  double most = 0, size = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    most = std::fmax(most, std::fabs(a[i] - b[i]));
    size = std::fmax(size, std::fabs(b[i]));
  }
  return most / size;
}
template <bool forward>
double worst_of(const Case& c) {
  const auto got = closed<forward>(c), exact = by_duals<forward>(c);
  double worst = std::fmax(off(got.value, exact.value),
                           std::fmax(off(got.dq, exact.dq), off(got.dv, exact.dv)));
  if (forward) worst = std::fmax(worst, off(got.dtau, exact.dtau));
  return worst;
}

/// Trees of nine bodies, every joint, rotors, gravity aslant, wrenches. Control: wrenches left out.
TEST(DynamicsDerivatives, AreThoseOfDuals) {
  double inverse = 0, forward = 0, control = HUGE_VAL;
  for (const char* root : {"free", "spherical", "revolute", "prismatic", "planar", "cylindrical"})
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      Case c = random_case(root, seed);
      inverse = std::fmax(inverse, worst_of<false>(c));
      forward = std::fmax(forward, worst_of<true>(c));
      const auto exact = by_duals<false>(c);
      c.wrench.clear();
      control = std::fmin(control, off(closed<false>(c).dq, exact.dq));
    }
  keeps("inverse dynamics, of the largest entry", inverse, 1e-13);
  keeps("forward dynamics, of the largest entry", forward, 1e-11);
  breaks("the same without the wrenches", control, 1e-4);
}

/// Y θ is the inverse dynamics, whatever θ: those of the builder, bodies on fixed joints and of the
/// world included. Control: without the products of inertia.
TEST(DynamicsDerivatives, TheRegressorGivesTheInverseDynamics) {
  double worst = 0, control = HUGE_VAL;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    test::RandomTree random(2 * seed);  // without rotors
    MechanismBuilder builder("t");
    std::vector<BodySpec> bodies;
    for (const char* type :
         {"free", "revolute", "fixed", "spherical", "planar", "fixed", "helical"}) {
      const int i = int(bodies.size());
      bodies.push_back(
          random.body(i, i == 0 ? "world" : "body_" + std::to_string(random.below(i)), type));
    }
    for (const BodySpec& b : bodies) builder.add(b);
    const Mechanism m = builder.gravity({1, 2, -9.81}).build();
    Workspace<double> w(m);
    DerivativeWorkspace<double> d(m);
    const size_t nv = size_t(m.nv()), cols = 10 * m.bodies().size();
    Vec q = random.q(m), v(nv), a(nv), tau(nv), got(nv), crude(nv), Y(nv * cols);
    for (Vec* x : {&v, &a})
      for (double& each : *x) each = random.uniform(-1, 1);
    rnea<double>(m, w, q, v, a, {}, tau);
    inertial_regressor<double>(m, w, d, q, v, a, Y);
    for (size_t b = 0; b < m.bodies().size(); ++b)
      for (const BodySpec& s : bodies) {
        if (s.name != m.bodies()[b].name) continue;
        const Pose at{s.mass.axes, s.mass.com};
        const auto I = to_parent(at, RigidInertia<double>{s.mass.mass, {0, 0, 0}, s.mass.inertia});
        const double theta[]{I.m,    I.mc.x, I.mc.y, I.mc.z, I.I.xx,
                             I.I.xy, I.I.xz, I.I.yy, I.I.yz, I.I.zz};
        for (size_t k = 0; k < 10; ++k)
          for (size_t i = 0; i < nv; ++i) {
            const double part = theta[k] * Y[i + nv * (10 * b + k)];
            got[i] += part;
            if (k != 5 && k != 6 && k != 8) crude[i] += part;
          }
      }
    worst = std::fmax(worst, off(got, tau));
    control = std::fmin(control, off(crude, tau));
  }
  keeps("Y θ less the inverse dynamics, of the largest torque", worst, 1e-14);
  breaks("the same without products of inertia", control, 1e-5);
}

/// τ = m l² v̇ + m g l sin q, far from the world's origin too.
TEST(DynamicsDerivatives, OfAPendulum) {
  const double mass = 2, l = 0.7, g = 9.81, q = 0.6, a = 0.4;
  MechanismBuilder b("pendulum");
  b.gravity({0, 0, -g});
  BodySpec rod;
  rod.name = "rod";
  rod.parent = "world";
  rod.joint.name = "hinge";
  rod.joint.type = "revolute";
  rod.joint.axis = {0, 1, 0};
  rod.placement = {Mat3<double>::identity(), {1e6, -2e6, 3e6}};
  rod.mass = {mass, {0, 0, -l}, {}, Mat3<double>::identity()};
  b.add(rod);
  const Mechanism m = b.build();
  Workspace<double> w(m);
  DerivativeWorkspace<double> d(m);
  Vec tau(1), dq(1), dv(1);
  rnea_derivatives<double>(m, w, d, Vec{q}, Vec{3.0}, Vec{a}, {}, tau, dq, dv);
  keeps("torque", std::fabs(tau[0] / (mass * l * l * a + mass * g * l * std::sin(q)) - 1), 1e-15);
  keeps("its derivative by the angle", std::fabs(dq[0] / (mass * g * l * std::cos(q)) - 1), 1e-15);
  keeps("its derivative by the rate", std::fabs(dv[0]), 1e-14);
}

/// Eight states in lanes have the bits of one.
TEST(DynamicsDerivatives, InLanesHaveTheBitsOfOneState) {
  using phs::Pack8;
  const Case c = random_case("free", 3);
  const auto one = closed<true>(c);
  Workspace<Pack8> w(*c.m);
  DerivativeWorkspace<Pack8> d(*c.m);
  const size_t n = c.nv();
  std::vector<Force<Pack8>> wrench;
  for (const auto& f : c.wrench) wrench.push_back({Vec3<Pack8>(f.n), Vec3<Pack8>(f.f)});
  std::vector<Pack8> vdot(n), dq(n * n), dv(n * n), dtau(n * n);
  aba_derivatives<Pack8>(*c.m, w, d, as<Pack8>(c.q), as<Pack8>(c.v), {as<Pack8>(c.given), wrench},
                         vdot, dq, dv, dtau);
  for (size_t i = 0; i < n * n; ++i)
    for (int l : {0, 7}) {
      EXPECT_EQ(dq[i][l], one.dq[i]);
      EXPECT_EQ(dv[i][l], one.dv[i]);
      EXPECT_EQ(dtau[i][l], one.dtau[i]);
    }
}

}  // namespace
}  // namespace porthos::mechanics::dynamics_derivatives_test
