// Rigid impacts at one instant: exact outcomes, energy, any order of the contacts.
#include "contact/impact.h"

#include <algorithm>
#include <numeric>
#include <random>

#include "tests/support/reference.h"

namespace porthos::contact::impact_test {
namespace {

using phs::Quad;
using Numbers = std::vector<double>;

template <class T>
T fraction(const std::string& text) {
  const size_t slash = text.find('/');
  return slash == std::string::npos
             ? T(std::stod(text))
             : T(std::stod(text.substr(0, slash))) / T(std::stod(text.substr(slash + 1)));
}
template <class T>
std::vector<T> fractions(const nlohmann::json& list) {
  std::vector<T> all;
  for (const std::string each : list) all.push_back(fraction<T>(each));
  return all;
}

/// Masses in a row or a box; contacts are rows of J, J v >= 0.
template <class T>
struct Bodies {
  std::vector<T> mass, v;
  std::vector<std::vector<T>> J;
  std::vector<T> losses = {};

  T energy() const {
    T sum(0.0);
    for (size_t i = 0; i < v.size(); ++i) sum = sum + T(0.5) * mass[i] * v[i] * v[i];
    return sum;
  }
  std::vector<T> rates() const {
    std::vector<T> r;
    for (const auto& row : J)
      r.push_back(std::inner_product(row.begin(), row.end(), v.begin(), T(0.0)));
    return r;
  }
  std::vector<T> W() const {
    std::vector<T> w;
    for (const auto& a : J)
      for (const auto& b : J) {
        T sum(0.0);
        for (size_t i = 0; i < v.size(); ++i) sum = sum + a[i] * b[i] / mass[i];
        w.push_back(sum);
      }
    return w;
  }
  /// @return the largest difference of the rates of the gaps from those of the motion after it
  T hit(Simultaneous rule, const Numbers& e) {
    RigidImpact<T> impact(J.size());
    auto r = rates();
    impact.solve(W(), r, e, rule);
    for (size_t k = 0; k < J.size(); ++k)
      for (size_t i = 0; i < v.size(); ++i) v[i] = v[i] + J[k][i] * impact.impulses()[k] / mass[i];
    losses.assign(impact.losses().begin(), impact.losses().end());
    T off(0.0);
    const auto now = rates();
    for (size_t k = 0; k < r.size(); ++k)
      off = std::max(off, std::max(T(r[k] - now[k]), T(now[k] - r[k])));
    return off;
  }
};

/// The outcomes of the reference, in every order of the contacts, to two roundings of a double.
TEST(Impact, ExactFractionsInAnyOrder) {
  const auto reference = test::read_json(test::data_file("reference/q_simultaneous_impacts.json"));
  double worst = 0, worst_loss = 0;
  int outcomes = 0;
  for (const auto& problem : reference["problems"]) {
    Bodies<Quad> start{fractions<Quad>(problem["mass"]), fractions<Quad>(problem["v_before"]), {}};
    for (const auto& row : problem["J"]) start.J.push_back(fractions<Quad>(row));
    const auto compare = [&](Simultaneous rule, double e, const nlohmann::json& expected) {
      const auto v = fractions<Quad>(expected["v"]);
      std::vector<size_t> order(start.J.size());
      std::iota(order.begin(), order.end(), 0);
      Numbers first;
      do {
        Bodies<Quad> b = start;
        for (size_t k = 0; k < order.size(); ++k) b.J[k] = start.J[order[k]];
        b.hit(rule, Numbers(b.J.size(), e));
        Numbers rounded;
        for (size_t i = 0; i < v.size(); ++i) {
          rounded.push_back(double(b.v[i]) + 0.0);
          const double size = std::max(1.0, std::fabs(double(v[i])));
          worst = std::max(worst, std::fabs(double(b.v[i]) - double(v[i])) / size);
        }
        if (first.empty()) first = rounded;
        for (size_t i = 0; i < v.size(); ++i)
          EXPECT_NEAR(rounded[i], first[i], 1e-30);  // the same bits, or 0
        Quad lost(0.0);
        for (const Quad& each : b.losses) {
          EXPECT_GE(each, Quad(0.0));
          lost += each;
        }
        const Quad off = start.energy() - b.energy() - lost;
        worst_loss = std::max(worst_loss, std::fabs(double(off)));
        if (expected.contains("loss"))
          worst = std::max(worst, std::fabs(double(lost - fraction<Quad>(expected["loss"]))));
        ++outcomes;
      } while (std::next_permutation(order.begin(), order.end()));
    };
    compare(Simultaneous::moreau, 0, problem["plastic"]);
    compare(Simultaneous::moreau, 1, problem["moreau"]["e=1"]);
    compare(Simultaneous::moreau, 0.5, problem["moreau"]["e=1/2"]);
    compare(Simultaneous::reflections, 0, problem["plastic"]);
    compare(Simultaneous::reflections, 1, problem["generalized_reflection"]);
    compare(Simultaneous::reflections, 0.5, problem["reflection_blend_e=1/2"]);
  }
  std::printf("  %d outcomes: off by %.1e   bound 2.2e-16; losses from the energy by %.1e\n",
              outcomes, worst, worst_loss);
  EXPECT_LE(worst, 2.2e-16);
  EXPECT_LE(worst_loss, 1e-30);
}

/// Both rules are offered because they differ: a row of three balls.
TEST(Impact, TheRulesDiffer) {
  const Bodies<double> row{{1, 1, 1}, {1, 0, 0}, {{-1, 1, 0}, {0, -1, 1}}};
  Bodies<double> a = row, b = row;
  a.hit(Simultaneous::reflections, {1, 1});
  b.hit(Simultaneous::moreau, {1, 1});
  EXPECT_NEAR(a.v[2], 1, 1e-15);
  EXPECT_NEAR(b.v[0], -1.0 / 3, 1e-15);
}

/// One contact: v⁺ = -e v⁻, the loss (1 - e²)(G v)²/(2 W).
TEST(Impact, OneContact) {
  for (const double e : {0.0, 0.3, 1.0}) {
    Bodies<double> pair{{2, 5}, {1.5, -0.5}, {{-1, 1}}};
    pair.hit(Simultaneous::reflections, {e});
    EXPECT_NEAR(pair.v[1] - pair.v[0], 2 * e, 1e-15);
    EXPECT_NEAR(2 * pair.v[0] + 5 * pair.v[1], 0.5, 1e-15);
    EXPECT_NEAR(pair.losses[0], (1 - e * e) * 4 / (2 * 0.7), 1e-15);
  }
}

/// Random bodies, also with more contacts than freedoms: nothing approaches afterwards, no energy
/// is made, reflections with e = 1 keep it where a motion leaves all contacts, and the losses are
/// the difference. Control: v⁺ = -e v⁻ at each of two contacts, which may need an impulse that
/// pulls.
TEST(Impact, RandomBodiesNeverGainEnergy) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1, 1);
  double gained = -1, elastic = 0, booked = 0, approach = 0, negative = 0, control = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const size_t n = 2 + size_t(trial % 4), m = 1 + size_t(trial / 4 % 7);
    Bodies<Quad> b;
    for (size_t i = 0; i < n; ++i) {
      b.mass.push_back(std::exp(2 * number(random)));
      b.v.push_back(number(random));
    }
    Numbers e;
    const bool keeps = trial % 3 == 0;
    for (size_t k = 0; k < m; ++k) {
      b.J.emplace_back();
      for (size_t i = 0; i < n; ++i) b.J.back().push_back(number(random));
      e.push_back(keeps ? 1 : 0.5 + 0.5 * number(random));
    }
    const auto rule = trial / 28 % 2 == 0 ? Simultaneous::reflections : Simultaneous::moreau;
    const Bodies<Quad> start = b;
    b.hit(rule, e);
    const Quad before = start.energy(),
               lost = std::accumulate(b.losses.begin(), b.losses.end(), Quad(0.0));
    const double change = double((b.energy() - before) / before);
    gained = std::max(gained, change);
    if (keeps && rule == Simultaneous::reflections && m <= n)
      elastic = std::max(elastic, std::fabs(change));
    booked = std::max(booked, std::fabs(double((before - b.energy() - lost) / before)));
    for (const Quad& r : b.rates()) approach = std::max(approach, -double(r));
    for (const Quad& each : b.losses) negative = std::min(negative, double(each));
    if (m != 2) continue;
    const auto W = start.W(), r = start.rates();
    const Quad det = W[0] * W[3] - W[1] * W[2];
    const Quad c0 = -(1 + e[0]) * r[0], c1 = -(1 + e[1]) * r[1];
    const Quad i0 = (W[3] * c0 - W[1] * c1) / det, i1 = (W[0] * c1 - W[2] * c0) / det;
    if (r[0] < 0 && r[1] < 0)
      control = std::max(control, double((i0 * (r[0] + c0 / 2) + i1 * (r[1] + c1 / 2)) / before));
  }
  std::printf(
      "  energy gained %.1e   bound 1e-25 (v⁺ = -e v⁻ for each: %.2f); e = 1 off by %.1e   bound "
      "1e-25; losses off by %.1e   bound 1e-23; approach left %.1e   bound 1e-25\n",
      gained, control, elastic, booked, approach);
  EXPECT_LE(gained, 1e-25);
  EXPECT_LE(elastic, 1e-25);
  EXPECT_LE(booked, 1e-23);
  EXPECT_LE(approach, 1e-25);
  EXPECT_GE(negative, 0);
  EXPECT_GT(control, 0.01);
}

}  // namespace
}  // namespace porthos::contact::impact_test
