// Every device of the catalogue with a model, and with them every family: what one energy implies.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <functional>
#include <random>
#include <set>

#include "phs/error.h"
#include "tests/support/bounds.h"
#include "vsa/catalogue.h"
#include "vsa/families.h"

namespace porthos::test::families_test {
namespace {

using phs::Dual;
using phs::Pack4;
using phs::Pack8;
using phs::Quad;
using vsa::Device;
using vsa::ElasticPtr;

struct Place {
  double q, theta, sigma;
};

std::vector<Device> models() {
  std::vector<Device> list;
  for (const auto& d : vsa::devices())
    if (!d.family.empty()) list.push_back(d);
  return list;
}

/// Places all over the range, beyond the stops too.
std::vector<Place> places(const Device& d, int count, unsigned seed = 1) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto [low, high] = std::minmax_element(d.sigma.begin(), d.sigma.end());
  std::vector<Place> list;
  for (int i = 0; i < count; ++i) {
    const bool moving = vsa::elastic_of(d)->traits().translation_invariant;
    const double theta = moving ? 2 * unit(generator) : d.theta + 0.3 * unit(generator);
    const double phi = 1.05 * d.deflection * unit(generator);
    list.push_back(
        {(moving ? theta : 0) + phi, theta, *low + (*high - *low) * (0.5 + 0.5 * unit(generator))});
  }
  return list;
}

TEST(Families, TheCatalogueHasOneOfEach) {
  std::set<std::string> shown;
  for (const auto& d : models()) shown.insert(vsa::elastic_of(d)->traits().family);
  for (const auto& f : vsa::families()) EXPECT_TRUE(shown.contains(f.name)) << f.name;
  EXPECT_EQ(vsa::families().size(), 13u);
}

// The slopes against dual numbers through the energy, the Hessian against dual numbers through the
// slopes.
TEST(Families, SlopesAndStiffnessAreDerivativesOfTheEnergy) {
  for (const auto& d : models()) {
    const auto e = vsa::elastic_of(d);
    double slope = 0, curvature = 0;
    for (const auto& p : places(d, 100)) {
      const auto s = e->slopes(p.q, p.theta, p.sigma);
      const auto H = e->hessian(p.q, p.theta, p.sigma);
      const double first[] = {s.q, s.theta, s.sigma};
      double size1 = 1e-300, size2 = 1e-300;
      for (size_t i = 0; i < 3; ++i) size1 = std::max(size1, std::fabs(first[i]));
      for (const auto& row : H)
        for (const double h : row) size2 = std::max(size2, std::fabs(h));
      for (size_t i = 0; i < 3; ++i) {
        const Dual q(p.q, i == 0), theta(p.theta, i == 1), sigma(p.sigma, i == 2);
        slope = std::max(slope, std::fabs(e->energy(q, theta, sigma).d - first[i]) / size1);
        const auto ds = e->slopes(q, theta, sigma);
        const double second[] = {ds.q.d, ds.theta.d, ds.sigma.d};
        for (size_t j = 0; j < 3; ++j)
          curvature = std::max(curvature, std::fabs(second[j] - H[i][j]) / size2);
      }
    }
    keeps((d.name + ": slopes by duals").c_str(), slope, 1e-13);
    keeps((d.name + ": stiffness by duals").c_str(), curvature, 1e-13);
  }
}

template <class P>
void expect_lanes(const Device& d) {
  const auto e = vsa::elastic_of(d);
  const auto all = places(d, 8 * 40, 3);
  constexpr int w = phs::lanes<P>;
  for (size_t at = 0; at + size_t(w) <= all.size(); at += size_t(w)) {
    P q(0.0), theta(0.0), sigma(0.0);
    for (int i = 0; i < w; ++i) {
      const auto& p = all[at + size_t(i)];
      q.set(i, p.q);
      theta.set(i, p.theta);
      sigma.set(i, p.sigma);
    }
    const P E = e->energy(q, theta, sigma);
    const auto s = e->slopes(q, theta, sigma);
    for (int i = 0; i < w; ++i) {
      const auto& p = all[at + size_t(i)];
      const auto one = e->slopes(p.q, p.theta, p.sigma);
      const double lanes[] = {E[i], s.q[i], s.theta[i], s.sigma[i]};
      const double scalars[] = {e->energy(p.q, p.theta, p.sigma), one.q, one.theta, one.sigma};
      ASSERT_EQ(std::memcmp(lanes, scalars, sizeof lanes), 0) << d.name << " lane " << i;
    }
  }
}

TEST(Families, LanesHaveTheBitsOfOneNumber) {
  for (const auto& d : models()) {
    expect_lanes<Pack4>(d);
    expect_lanes<Pack8>(d);
  }
}

// The energy in double against 113 bits, at doubles: its conditioning, without any reference of
// ours.
TEST(Families, DoubleAgreesWith113Bits) {
  for (const auto& d : models()) {
    const auto e = vsa::elastic_of(d);
    double worst = 0, size = 0;
    for (const auto& p : places(d, 100)) {
      const auto s = e->slopes(p.q, p.theta, p.sigma);
      const auto exact = e->slopes(Quad(p.q), Quad(p.theta), Quad(p.sigma));
      worst = std::max(worst, std::fabs(double(exact.q - Quad(s.q))));
      size = std::max(size, std::fabs(s.q));
    }
    keeps((d.name + ": torque against 113 bits").c_str(), worst / size, 1e-14);
  }
}

// E(q + c, θ + c, σ) = E(q, θ, σ). c is a power of two and so large a grid that both sums are
// exact.
TEST(Families, TurnedAsAWholeNothingChanges) {
  int others = 0;
  for (const auto& d : models()) {
    const auto e = vsa::elastic_of(d);
    double worst = 0, forces = 0, size = 0;
    for (auto p : places(d, 100)) {
      p.q = std::ldexp(std::round(std::ldexp(p.q, 40)), -40);
      p.theta = std::ldexp(std::round(std::ldexp(p.theta, 40)), -40);
      const double E = e->energy(p.q, p.theta, p.sigma);
      worst = std::max(worst, std::fabs(e->energy(p.q + 64, p.theta + 64, p.sigma) - E));
      const auto s = e->slopes(p.q, p.theta, p.sigma);
      forces = std::max(forces, std::fabs(s.q + s.theta));
      size = std::max(size, E);
    }
    if (e->traits().translation_invariant) {
      keeps((d.name + ": turned by 64 rad").c_str(), worst / size, 0);
      keeps((d.name + ": sum of the torques").c_str(), forces, 0);
    } else {  // the control: two servos with levers are fixed to the base
      breaks((d.name + ": turned by 64 rad").c_str(), worst / size, 1e-3);
      breaks((d.name + ": sum of the torques").c_str(), forces, 1e-3);
      ++others;
    }
  }
  EXPECT_EQ(others, 1);
}

/// ∮ of what the slopes give, round a closed curve, by the trapezium rule of `n` points: it
/// converges exponentially for analytic integrands, algebraically at stops and spline knots.
double cycle_work(const std::function<vsa::Slopes<double>(Place)>& slopes, const Device& d, int n,
                  double* turned_over) {
  const auto [low, high] = std::minmax_element(d.sigma.begin(), d.sigma.end());
  const double mid = (*low + *high) / 2, half = (*high - *low) / 2;
  const double reach =
      (d.limits.deflection < HUGE_VAL && d.family == "cosh" ? 0.3 : 0.7) * d.deflection;
  double work = 0, all = 0;
  for (int i = 0; i < n; ++i) {
    const double t = 2 * M_PI * i / n, dt = 2 * M_PI / n;
    const double theta = d.theta + 0.2 * std::sin(2 * t), dtheta = 0.4 * std::cos(2 * t);
    const double base = d.theta != 0 ? d.theta : 0;
    const double q = theta - base + reach * (0.7 * std::cos(t) + 0.3),
                 dq = dtheta - 0.7 * reach * std::sin(t);
    const double sigma = mid + 0.9 * half * std::sin(t + 0.3),
                 dsigma = 0.9 * half * std::cos(t + 0.3);
    const auto s = slopes({q, theta, sigma});
    const double p = s.q * dq + s.theta * dtheta + s.sigma * dsigma;
    work += p * dt;
    all += std::fabs(p) * dt;
  }
  *turned_over = all;
  return std::fabs(work) / all;
}

TEST(Families, AClosedCycleDoesNoWork) {
  for (const auto& d : models()) {
    const auto e = vsa::elastic_of(d);
    double all = 0;
    const bool smooth = d.family != "antagonistic_quadratic" && d.family != "tabulated" &&
                        d.family != "maccepa_profile" && d.family.find("cam") == std::string::npos;
    const auto honest = [&](Place p) { return e->slopes(p.q, p.theta, p.sigma); };
    const double coarse = cycle_work(honest, d, 2000, &all),
                 fine = cycle_work(honest, d, 32000, &all);
    // Splines and slack springs: the integrand is C¹ in places, the rule of order 2 or 3.
    keeps((d.name + ": work of a cycle").c_str(), fine, smooth ? 1e-13 : 1e-9);
    if (!smooth) keeps((d.name + ": it converges").c_str(), fine, 0.1 * coarse + 1e-13);
    // The control: forget the stiffness port, as models do that turn k by a signal.
    if (e->traits().sigma.empty()) continue;
    const auto textbook = [&](Place p) {
      auto s = e->slopes(p.q, p.theta, p.sigma);
      s.sigma = 0;
      return s;
    };
    breaks((d.name + ": without the stiffness port").c_str(), cycle_work(textbook, d, 32000, &all),
           1e-3);
  }
}

// Across a stop and across σ's end E, its slopes and its stiffness go on without a jump.
TEST(Families, LimitsAreEnergies) {
  int with_stops = 0;
  for (const auto& d : models()) {
    if (!(d.limits.deflection < HUGE_VAL)) continue;
    ++with_stops;
    const auto e = vsa::elastic_of(d);
    vsa::Limits free = d.limits;
    free.deflection = HUGE_VAL;
    vsa::Values v;
    for (const auto& p : d.parameters) v[p.name] = p.value;
    const auto bare = vsa::make_elastic(d.family, v, free);
    const double sigma = d.family == "cosh" ? 0.1 : d.sigma.back(),
                 limit = d.limits.deflection - (d.family == "cosh" ? 0.1 : 0);
    for (const double depth : {1e-3, 1e-4}) {
      const double q = limit + depth, k = d.limits.stop_stiffness;
      const double more = e->energy(q, 0.0, sigma) - bare->energy(q, 0.0, sigma);
      const double force = e->slopes(q, 0.0, sigma).q - bare->slopes(q, 0.0, sigma).q;
      const double stiff = e->stiffness(q, 0, sigma) - bare->stiffness(q, 0, sigma);
      const double scale = std::fabs(bare->energy(q, 0.0, sigma));
      EXPECT_NEAR(more, k / 3 * depth * depth * depth, 1e-14 * scale + 1e-9 * more) << d.name;
      EXPECT_NEAR(force, k * depth * depth,
                  1e-9 * force + 1e-13 * std::fabs(bare->slopes(q, 0.0, sigma).q))
          << d.name;
      EXPECT_NEAR(stiff, 2 * k * depth, 1e-9 * stiff + 1e-13 * bare->stiffness(q, 0, sigma))
          << d.name;
    }
    const double inside = limit - 1e-9;
    EXPECT_EQ(e->energy(inside, 0.0, sigma), bare->energy(inside, 0.0, sigma)) << d.name;
  }
  EXPECT_GE(with_stops, 7);
  const auto stopped = vsa::lever_arm(
      {.ks = 100}, {.sigma_lower = 0, .sigma_upper = 1, .sigma_stop_stiffness = 300});
  EXPECT_NEAR(stopped->slopes(0.0, 0.0, 1.1).sigma, 300 * 0.01, 1e-13);
  EXPECT_NEAR(stopped->slopes(0.0, 0.0, -0.1).sigma, -300 * 0.01, 1e-13);
}

}  // namespace
}  // namespace porthos::test::families_test
