// Identities that tie the algorithms to each other, for every joint type and 200 random trees of up
// to 60 bodies.
#include <gtest/gtest.h>

#include <cmath>

#include "mechanics/aba.h"
#include "mechanics/crba.h"
#include "mechanics/kinematics.h"
#include "mechanics/mechanical_model.h"
#include "mechanics/momentum.h"
#include "mechanics/rnea.h"
#include "phs/system/check.h"
#include "tests/support/random_tree.h"

namespace porthos::mechanics::identities_test {
namespace {

using Vec = std::vector<double>;

/// |a - b| over the larger of the two (2-norms).
double relative(const Vec& a, const Vec& b) {
  double d = 0, s = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    d += (a[i] - b[i]) * (a[i] - b[i]);
    s += a[i] * a[i] + b[i] * b[i];
  }
  return std::sqrt(d / std::max(s / 2, 1e-300));
}

struct Worst {
  double aba_of_rnea = 0, momentum = 0, velocity = 0, field = 0;
};

/// ṗ of the Hamiltonian field against RNEA: v̇ = ABA(q, v, τ) satisfies RNEA (checked beside), and
/// p(q, v) is Mv; so ṗ must be d/dt of p(q, v) along (q̇, v̇), by central differences in 113 bits.
Vec momentum_rate(const Mechanism& m, const Vec& q, const Vec& v, const Vec& vdot) {
  using E = phs::Quad;
  Workspace<E> w(m);
  const E h = 1e-7;
  const auto momenta_at = [&](E t) {
    // q along the exact flow of constant body rates to second order: q + t q̇ + t²/2 q̈, with q̈
    // from rates(q̇...)
    std::vector<E> qe(q.begin(), q.end()), qd(q.size()), qd2(q.size()), ve(v.begin(), v.end()),
        p(q.size());
    coordinate_rates<E>(m, qe, ve, qd);
    std::vector<E> qm(q.size());
    for (size_t i = 0; i < q.size(); ++i) qm[i] = qe[i] + t * qd[i] / 2;
    std::vector<E> vm(v.size());
    for (size_t i = 0; i < v.size(); ++i) vm[i] = v[i] + t * E(vdot[i]) / 2;
    coordinate_rates<E>(
        m, qm, vm, qd2);  // midpoint rule: error O(t³), odd terms cancel in the difference below
    for (size_t i = 0; i < q.size(); ++i) qe[i] += t * qd2[i];
    for (size_t i = 0; i < v.size(); ++i) ve[i] += t * E(vdot[i]);
    momenta_from_rates<E>(m, w, qe, ve, p);
    return p;
  };
  // Richardson on the central difference: error O(h⁴).
  const auto central = [&](E step) {
    const auto a = momenta_at(step), b = momenta_at(-step);
    std::vector<E> d(a.size());
    for (size_t i = 0; i < a.size(); ++i) d[i] = (a[i] - b[i]) / (2 * step);
    return d;
  };
  const auto coarse = central(2 * h), fine = central(h);
  Vec rate(q.size());
  for (size_t i = 0; i < q.size(); ++i) rate[i] = double((4 * fine[i] - coarse[i]) / 3);
  return rate;
}

void check_tree(test::RandomTree& r, const Mechanism& m, Worst& worst, bool flow = true) {
  Workspace<double> w(m);
  const size_t nv = size_t(m.nv()), nq = size_t(m.nq());
  const Vec q = r.q(m), v = r.numbers(m.nv(), 2), tau = r.numbers(m.nv(), 10);
  std::vector<Force<double>> wrench(m.nodes().size());
  for (auto& f : wrench) f = {r.vector(3), r.vector(3)};

  Vec vdot(nv), back(nv);
  aba<double>(m, w, q, v, {tau, wrench}, vdot);
  rnea<double>(m, w, q, v, vdot, wrench, back);
  worst.aba_of_rnea = std::max(worst.aba_of_rnea, relative(back, tau));

  // joint momenta against CRBA: μ = M v
  Vec p(nq), M(nv * nv), Mv(nv, 0.0);
  momenta_from_rates<double>(m, w, q, v, p);
  crba<double>(m, w, q, M);
  for (size_t j = 0; j < nv; ++j)
    for (size_t i = 0; i < nv; ++i) Mv[i] += M[i + nv * j] * v[j];
  rates_from_momenta<double>(m, w, q, p);
  worst.momentum = std::max(worst.momentum, relative(w.mu, Mv));
  worst.velocity = std::max(worst.velocity, relative(w.rate, v));

  // the field: q' = rates, p' = d/dt p along the motion that ABA (checked against RNEA above)
  // prescribes
  Vec q_dot(nq), p_dot(nq), q_rate(nq);
  hamiltonian_field<double>(m, w, q, p, {tau, wrench}, q_dot, p_dot);
  coordinate_rates<double>(m, q, v, q_rate);
  worst.field = std::max(worst.field, relative(q_dot, q_rate));
  if (flow) worst.field = std::max(worst.field, relative(p_dot, momentum_rate(m, q, v, vdot)));
}

TEST(Identities, EveryJointType) {
  for (const auto& type : joint_type_names()) {
    if (type == "fixed") continue;
    Worst worst;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      test::RandomTree r(seed);
      for (const char* root : {"revolute", "free", "spherical", "fixed"}) {
        const auto m = r.tree(6, root, type);
        check_tree(r, *m, worst);
      }
      check_tree(r, *r.tree(1, type), worst);
    }
    std::printf("  %-12s aba(rnea) %.1e  p=Mv %.1e  v %.1e  field %.1e   bounds 1e-11\n",
                type.c_str(), worst.aba_of_rnea, worst.momentum, worst.velocity, worst.field);
    EXPECT_LE(worst.aba_of_rnea, 1e-11) << type;
    EXPECT_LE(worst.momentum, 1e-11) << type;
    EXPECT_LE(worst.velocity, 1e-11) << type;
    EXPECT_LE(worst.field, 1e-11) << type;
  }
}

TEST(Identities, TwoHundredRandomTrees) {
  Worst worst;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    test::RandomTree r(seed * 7919);
    const char* roots[] = {"revolute", "free", "prismatic", "spherical"};
    check_tree(r, *r.tree(2 + int(seed * 58 / 200), roots[seed % 4]), worst);
  }
  std::printf("  aba(rnea) %.1e  p=Mv %.1e  v %.1e  field %.1e   bounds 1e-11\n", worst.aba_of_rnea,
              worst.momentum, worst.velocity, worst.field);
  EXPECT_LE(worst.aba_of_rnea, 1e-11);
  EXPECT_LE(worst.momentum, 1e-11);
  EXPECT_LE(worst.velocity, 1e-11);
  EXPECT_LE(worst.field, 1e-11);
}

// The field is J∇H exactly, on and off the unit sphere and with ξ·π ≠ 0: against 113-bit
// differences of H. `aligned` frames are orthonormal in every scalar; rounded random frames are so
// to 1e-16, and sliding joints feel it.
double field_against_gradient(bool aligned, double& off_sphere) {
  using phs::Quad;
  double worst = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    test::RandomTree r(seed);
    r.aligned = aligned;
    const auto m = r.tree(5, seed % 2 ? "free" : "spherical", "", {0, 0, -9.75});
    const MechanicalModel model(m);
    const auto system = model.instantiate<Quad>();
    const size_t n = size_t(model.description().nx);
    std::vector<Quad> x(n), dx(n);
    for (auto& c : x) c = r.uniform(-1, 1);  // |ξ| is anything
    system->field(0, x, {}, dx);
    Quad size = 0, diff = 0;
    for (size_t i = 0; i < n; ++i) {
      const Quad h = 1e-6, saved = x[i];
      const auto H = [&](Quad step) {
        x[i] = saved + step;
        return system->hamiltonian(x);
      };
      const auto slope = [&](Quad step) { return (H(step) - H(-step)) / (2 * step); };
      const Quad a = slope(h), b = slope(2 * h), c = slope(4 * h);
      x[i] = saved;
      const Quad ab = (4 * a - b) / 3, bc = (4 * b - c) / 3,
                 g = (16 * ab - bc) / 15;  // error O(h⁶)
      const Quad expected = i < n / 2 ? -g : g;
      const Quad got = dx[i < n / 2 ? n / 2 + i : i - n / 2];
      diff = std::max(diff, phs::abs(expected - got));
      size = std::max(size, phs::abs(got));
    }
    worst = std::max(worst, double(diff / size));
    const auto& rotation =
        *std::find_if(m->coordinates().begin(), m->coordinates().end(),
                      [](const auto& c) { return c.kind == phs::BlockKind::rotation; });
    Quad norm2 = 0;
    for (int k = 0; k < 4; ++k) norm2 += x[size_t(rotation.q + k)] * x[size_t(rotation.q + k)];
    off_sphere = std::max(off_sphere, std::fabs(double(norm2 - 1)));
  }
  return worst;
}

TEST(HamiltonianField, IsJGradHOffTheSphere) {
  double off_sphere = 0;
  const double aligned = field_against_gradient(true, off_sphere),
               rounded = field_against_gradient(false, off_sphere);
  std::printf(
      "  aligned frames %.1e  bound 1e-22 (h⁶ = 1e-36·H⁽⁷⁾, cancellation 1e-34/1e-6)   rounded "
      "frames %.1e  bound 1e-14\n",
      aligned, rounded);
  EXPECT_LE(aligned, 1e-22);
  EXPECT_LE(rounded, 1e-14);
  EXPECT_GT(off_sphere, 0.1) << "the states were meant to be off the sphere";
}

// Negative control: the lift that is right only on the sphere, π' = ½π∘ω + 2 ξ∘t, is not J∇H off
// it.
TEST(HamiltonianField, LiftNeedsItsNormFactor) {
  const Quaternion<double> xi{0.6, {0.8, 0.5, 0.3}}, pi{0.1, {0.2, -0.4, 0.7}};
  const Vec3d w{0.3, -0.2, 0.5}, t{1, 2, 3};
  double xi_dot[4], right[4];
  lifted_field(xi, pi, w, t, xi_dot, right);
  const auto a = pi * (0.5 * w), b = xi * (2.0 * t);
  EXPECT_GT(std::fabs(right[1] - (a.v.x + b.v.x)), 0.1);
}

TEST(Model, AxiomsHold) {
  for (const char* root : {"free", "spherical", "revolute"}) {
    test::RandomTree r(42);
    for (const auto gravity : {Vec3d{0, 0, 0}, Vec3d{1, 2, -9}}) {
      const auto m = r.tree(8, root, "", gravity);
      const MechanicalModel model(m);
      const auto report = phs::check(model);
      EXPECT_TRUE(report.holds()) << root << "\n" << report.text();
    }
  }
}

// Lane k equals the scalar evaluation bit for bit, for every joint type.
TEST(Lanes, EqualScalarBitForBit) {
  for (const auto& type : joint_type_names()) {
    test::RandomTree r(5);
    const auto m = r.tree(7, "free", type);
    const MechanicalModel model(m);
    const auto scalar = model.instantiate<double>();
    const auto lanes = model.instantiate<phs::Pack8>();
    const auto lanes4 = model.instantiate<phs::Pack4>();
    const size_t n = size_t(model.description().nx);
    std::vector<phs::Pack8> x8(n), dx8(n);
    std::vector<phs::Pack4> x4(n), dx4(n);
    std::vector<Vec> x(8, Vec(n));
    for (int l = 0; l < 8; ++l)
      for (size_t i = 0; i < n; ++i) {
        x[size_t(l)][i] = r.uniform(-3, 3);
        x8[i].set(l, x[size_t(l)][i]);
        if (l < 4) x4[i].set(l, x[size_t(l)][i]);
      }
    lanes->field(phs::Pack8(0.0), x8, {}, dx8);
    lanes4->field(phs::Pack4(0.0), x4, {}, dx4);
    const auto H8 = lanes->hamiltonian(x8);
    Vec dx(n);
    for (int l = 0; l < 8; ++l) {
      scalar->field(0, x[size_t(l)], {}, dx);
      for (size_t i = 0; i < n; ++i) {
        ASSERT_EQ(dx[i], dx8[i][l]) << type << " lane " << l << " component " << i;
        if (l < 4) {
          ASSERT_EQ(dx[i], dx4[i][l]) << type;
        }
      }
      ASSERT_EQ(scalar->hamiltonian(x[size_t(l)]), H8[l]) << type;
    }
  }
}

}  // namespace
}  // namespace porthos::mechanics::identities_test
