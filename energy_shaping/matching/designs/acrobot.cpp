#include <cmath>

#include "energy_shaping/matching/designs.h"
#include "energy_shaping/matching/designs/require.h"
#include "energy_shaping/matching/plant.h"

namespace porthos::energy_shaping {
namespace {

struct AcrobotForm {
  static constexpr int n = 2, m = 1;
  double c1, c2, c3, c4, c5, g;
  const char* name = "acrobot";
  std::array<std::pair<const char*, const char*>, 2> coordinates{
      {{"shoulder", "rad"}, {"elbow", "rad"}}};
  std::array<const char*, 1> inputs{"elbow"};
  template <class S>
  void mass(std::span<const S> q, std::span<S> M) const {
    const S c = S(c3) * phs::cos(q[1]);
    M[0] = S(c1 + c2) + S(2.0) * c;
    M[1] = M[2] = S(c2) + c;
    M[3] = S(c2);
  }
  template <class S>
  S potential(std::span<const S> q) const {
    return S(g) * (S(c4) * phs::cos(q[0]) + S(c5) * phs::cos(q[0] + q[1]));
  }
  template <class T>
  void input(std::span<const T>, std::span<T> G) const {
    G[0] = T(0.0);
    G[1] = T(1.0);
  }
};

/// With s = √(c1/c2), μ = -(1 + s), w = √(c1c2) the potential equation is
///   (∂1 + μ ∂2) V_d = (g/a2) (w - c3 cos q2) (c4 sin q1 + c5 sin(q1 + q2)),
/// and its right side a sum of sin(q1 + n q2), n = -1 … 2.
struct AcrobotDesign {
  static constexpr int n = 2;
  Acrobot d;
  std::string name = "acrobot (constant M_d)";
  std::vector<Gain> gains() const { return {{"ku", d.ku}, {"kv", d.kv}}; }
  template <class S, class T>
  void mass(std::span<const S>, std::span<const T>, std::span<S> Md) const {
    const double k = 1 - std::sqrt(d.c1 / d.c2);
    Md[0] = S(k * d.a2);
    Md[1] = Md[2] = S(d.a2);
    Md[3] = S(d.a3);
  }
  template <class S, class T>
  S potential(std::span<const S> q, std::span<const T> gain) const {
    const double mu = -(1 + std::sqrt(d.c1 / d.c2)), w = std::sqrt(d.c1 * d.c2);
    const double C[] = {-d.c3 * d.c4 / 2, w * d.c4 - d.c3 * d.c5 / 2, w * d.c5 - d.c3 * d.c4 / 2,
                        -d.c3 * d.c5 / 2};  // n = -1, 0, 1, 2
    S sum(0.0);
    for (int i = 0; i < 4; ++i)
      sum = sum +
            S(-d.g / d.a2 * C[i] / (1 + (i - 1) * mu)) * phs::cos(q[0] + S(double(i - 1)) * q[1]);
    const S z = q[1] - S(mu) * q[0];
    return sum + S(0.5) * S(gain[0]) * z * z;
  }
};

}  // namespace

Acrobot Acrobot::of(const phs::Model& model, double g) {
  if (model.description().nx != 4)
    throw InvalidArgument("'" + model.description().name + "' is no acrobot: it has " +
                          std::to_string(model.description().nx / 2) + " coordinates");
  const auto plant = model.instantiate<double>();
  const auto gradient = [&](double q1, double q2, double p1, double p2) {
    std::array<double, 4> x{q1, q2, p1, p2}, e{};
    plant->gradient(x, e);
    return e;
  };
  // The numbers come from M at a stretched and at a folded elbow, by inverting M⁻¹.
  const auto mass = [&](double q2, double M[3]) {
    const auto a = gradient(0, q2, 1, 0), b = gradient(0, q2, 0, 1);
    const double det = a[2] * b[3] - a[3] * b[2];
    M[0] = b[3] / det;
    M[1] = -a[3] / det;
    M[2] = a[2] / det;
  };
  double M0[3], M1[3];
  mass(0, M0);
  mass(std::acos(-1.0), M1);
  const double quarter = std::acos(0.0);
  const double both = -gradient(quarter, 0, 0, 0)[0], first = -gradient(quarter, quarter, 0, 0)[0];
  Acrobot d;
  d.g = g;
  d.c2 = 0.5 * (M0[2] + M1[2]);
  d.c3 = 0.25 * (M0[0] - M1[0]);
  d.c1 = 0.5 * (M0[0] + M1[0]) - d.c2;
  d.c4 = first / g;
  d.c5 = (both - first) / g;
  return d;
}

PlantPtr acrobot_plant(const Acrobot& d) {
  return plant(AcrobotForm{.c1 = d.c1, .c2 = d.c2, .c3 = d.c3, .c4 = d.c4, .c5 = d.c5, .g = d.g});
}

LoopPtr acrobot(const Acrobot& d, PlantPtr p, std::optional<MatchingOptions> options,
                const std::string& elbow_port) {
  const Requirement need("acrobot (constant M_d)");
  need(d.c1 > 0 && d.c2 > 0 && d.g > 0 && d.a2 > 0, "c1, c2, g, a2 > 0", {d.c1, d.c2, d.g, d.a2});
  need(d.c2 > d.c1,
       "c2 > c1, a second link heavier about the elbow than the first about the shoulder",
       {d.c2, d.c1});
  const double s = std::sqrt(d.c1 / d.c2), k = 1 - s;
  need(d.a3 > d.a2 / k, "a3 > a2/(1 - √(c1/c2)) so that M_d > 0", {d.a3, d.a2 / k});
  need(d.c4 > s * d.c5, "c4 > √(c1/c2) c5", {d.c4, s * d.c5});
  if (!p) p = acrobot_plant(d);
  if (!options) options = MatchingOptions{.region = {{-3.2, -3.2}, {3.2, 3.2}, 5}};
  return std::make_shared<MatchedLoop>(p, shaping(AcrobotDesign{.d = d}),
                                       std::vector<std::string>{elbow_port},
                                       std::vector<double>{0, 0}, *options);
}

}  // namespace porthos::energy_shaping
