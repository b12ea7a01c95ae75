// Products with the derivative of the Hamiltonian field: against duals on trees of every joint, its
// transpose, its symmetry, lanes and 113 bits.
#include "mechanics/derivatives/field_tangent.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mechanics/hamiltonian_field.h"
#include "tests/support/random_tree.h"

namespace porthos::mechanics::field_tangent_test {
namespace {

using Vec = std::vector<double>;

/// A tree at a state off the unit sphere, and directions.
struct Case {
  std::shared_ptr<const Mechanism> m;
  Vec q, p, dq, dp;
  size_t n() const { return q.size(); }
};
Case random_case(const std::string& root, std::uint64_t seed, bool gravity, bool aligned = false) {
  test::RandomTree random(seed);
  random.rotor = seed % 2 ? 0.1 : 0;
  random.aligned = aligned;
  Case c;
  c.m = random.tree(9, root, "", gravity ? Vec3d{1, 2, -9.81} : Vec3d{0, 0, 0});
  c.q = random.q(*c.m);
  for (Vec* v : {&c.p, &c.dq, &c.dp}) {
    v->resize(c.q.size());
    for (double& x : *v) x = random.uniform(-1, 1);
  }
  for (double& x : c.q) x *= 1.125;
  return c;
}
template <class T>
std::vector<T> as(const Vec& x) {
  return {x.begin(), x.end()};
}
/// Df (dq, dp), dq' first, and the field itself.
template <class T>
std::pair<std::vector<T>, std::vector<T>> product(const Case& c) {
  FieldTangent<T> tangent(*c.m);
  const size_t n = c.n();
  std::vector<T> field(2 * n), out(2 * n);
  tangent.at(as<T>(c.q), as<T>(c.p), std::span(field).first(n), std::span(field).subspan(n));
  tangent.times(as<T>(c.dq), as<T>(c.dp), std::span(out).first(n), std::span(out).subspan(n));
  return {field, out};
}
/// The same with duals.
std::pair<Vec, Vec> by_duals(const Case& c) {
  using phs::Dual;
  Workspace<Dual> w(*c.m);
  const size_t n = c.n();
  std::vector<Dual> q(n), p(n), f(2 * n);
  for (size_t i = 0; i < n; ++i) {
    q[i] = {c.q[i], c.dq[i]};
    p[i] = {c.p[i], c.dp[i]};
  }
  hamiltonian_field<Dual>(*c.m, w, q, p, {}, std::span(f).first(n), std::span(f).subspan(n));
  std::pair<Vec, Vec> r;
  for (const Dual& x : f) {
    r.first.push_back(x.v);
    r.second.push_back(x.d);
  }
  return r;
}
double largest(const Vec& x) {
  double most = 0;
  for (const double a : x) most = std::max(most, std::fabs(a));
  return most;
}
double apart(const Vec& a, const Vec& b) {
  double most = 0;
  for (size_t i = 0; i < a.size(); ++i) most = std::max(most, std::fabs(a[i] - b[i]));
  return most;
}

TEST(FieldTangent, IsTheDerivativeOnTreesOfEveryJoint) {
  double worst = 0;
  for (const auto& root : joint_type_names())
    for (const bool gravity : {false, true})
      for (std::uint64_t seed = 1; seed <= 6 && root != "fixed"; ++seed) {
        const Case c = random_case(root, seed, gravity);
        const auto [field, out] = product<double>(c);
        const auto [f, d] = by_duals(c);
        EXPECT_EQ(apart(field, f), 0) << "the field is the field";
        const double off = apart(out, d) / (1 + largest(d));
        worst = std::max(worst, off);
        EXPECT_LT(off, 1e-13) << root << ", seed " << seed;
      }
  std::printf("  off duals by %.1e of the largest   bound 1e-13\n", worst);
}

/// λ·(Df v) = (Dfᵀλ)·v. Control: without J the product is not the transpose.
TEST(FieldTangent, TransposeIsTheTranspose) {
  double worst = 0, control = HUGE_VAL;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Case c = random_case("free", seed, true);
    const size_t n = c.n();
    FieldTangent<double> tangent(*c.m);
    Vec a(n), b(n), v_q(n), v_p(n), back_q(n), back_p(n), not_q(n), not_p(n);
    test::RandomTree random(seed + 40);
    Vec lq(n), lp(n);
    for (size_t i = 0; i < n; ++i) {
      lq[i] = random.uniform(-1, 1);
      lp[i] = random.uniform(-1, 1);
    }
    tangent.at(c.q, c.p, a, b);
    tangent.times(c.dq, c.dp, v_q, v_p);
    tangent.transpose_times(lq, lp, back_q, back_p);
    tangent.times(lq, lp, not_q, not_p);
    double forth = 0, back = 0, wrong = 0, size = 0;
    for (size_t i = 0; i < n; ++i) {
      forth += lq[i] * v_q[i] + lp[i] * v_p[i];
      back += back_q[i] * c.dq[i] + back_p[i] * c.dp[i];
      wrong += not_q[i] * c.dq[i] + not_p[i] * c.dp[i];
      size += std::fabs(lq[i] * v_q[i]) + std::fabs(lp[i] * v_p[i]);
    }
    worst = std::max(worst, std::fabs(forth - back) / size);
    control = std::min(control, std::fabs(forth - wrong) / size);
  }
  std::printf("  off by %.1e of the moduli   bound 1e-14;  without J by %.1e\n", worst, control);
  EXPECT_LT(worst, 1e-14);
  EXPECT_GT(control, 1e-3);
}

TEST(FieldTangent, LanesAreTheBitsOfOne) {
  using phs::Pack4;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Case c = random_case("free", seed, true);
    const size_t n = c.n();
    FieldTangent<Pack4> wide(*c.m);
    FieldTangent<double> one(*c.m);
    std::vector<Pack4> q(n), p(n), dq(n), dp(n), a(n), b(n), x(n), y(n);
    const auto lane = [](double value, int k) { return value * (1 + 0.125 * k); };
    for (size_t i = 0; i < n; ++i)
      for (int k = 0; k < 4; ++k) {
        q[i].set(k, c.q[i]);
        p[i].set(k, lane(c.p[i], k));
        dq[i].set(k, lane(c.dq[i], k));
        dp[i].set(k, c.dp[i]);
      }
    wide.at(q, p, a, b);
    wide.times(dq, dp, x, y);
    for (int k = 0; k < 4; ++k) {
      Vec one_p(n), one_dq(n), f(n), g(n), u(n), v(n);
      for (size_t i = 0; i < n; ++i) {
        one_p[i] = lane(c.p[i], k);
        one_dq[i] = lane(c.dq[i], k);
      }
      one.at(c.q, one_p, f, g);
      one.times(one_dq, c.dp, u, v);
      for (size_t i = 0; i < n; ++i) {
        EXPECT_EQ(x[i][k], u[i]);
        EXPECT_EQ(y[i][k], v[i]);
      }
    }
  }
}

/// In 113 bits the double product is off by its rounding. Frames without rotation are exact there.
TEST(FieldTangent, DoubleIsOffThe113BitsByRounding) {
  using phs::Quad;
  double worst = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Case c = random_case("free", seed, true, true);
    const auto exact = product<Quad>(c).second;
    const auto rounded = product<double>(c).second;
    double off = 0, size = 1;
    for (size_t i = 0; i < exact.size(); ++i) {
      size = std::max(size, std::fabs(double(exact[i])));
      off = std::max(off, std::fabs(double(Quad(rounded[i]) - exact[i])));
    }
    worst = std::max(worst, off / size);
  }
  std::printf("  off 113 bits by %.1e of the largest   bound 1e-13\n", worst);
  EXPECT_LT(worst, 1e-13);
}

}  // namespace
}  // namespace porthos::mechanics::field_tangent_test
