#include "energy_shaping/matching/designs.h"
#include "energy_shaping/matching/designs/require.h"
#include "energy_shaping/matching/plant.h"

namespace porthos::energy_shaping {
namespace {

struct InertiaWheelForm {
  static constexpr int n = 2, m = 1;
  double I1, I2, m3;
  const char* name = "inertia-wheel pendulum";
  std::array<std::pair<const char*, const char*>, 2> coordinates{
      {{"pendulum", "rad"}, {"wheel", "rad"}}};
  std::array<const char*, 1> inputs{"wheel"};
  template <class S>
  void mass(std::span<const S>, std::span<S> M) const {
    M[0] = S(I1);
    M[1] = M[2] = S(0.0);
    M[3] = S(I2);
  }
  template <class S>
  S potential(std::span<const S> q) const {
    return S(m3) * phs::cos(q[0]);
  }
  template <class T>
  void input(std::span<const T>, std::span<T> G) const {
    G[0] = T(-1.0);
    G[1] = T(1.0);
  }
};

struct InertiaWheelDesign {
  static constexpr int n = 2;
  InertiaWheelPendulum d;
  std::string name = "inertia-wheel pendulum (constant M_d)";
  std::vector<Gain> gains() const { return {{"k1", d.k1}, {"kv", d.kv}}; }
  template <class S, class T>
  void mass(std::span<const S>, std::span<const T>, std::span<S> Md) const {
    Md[0] = S(d.a1);
    Md[1] = Md[2] = S(d.a2);
    Md[3] = S(d.a3);
  }
  template <class S, class T>
  S potential(std::span<const S> q, std::span<const T> k) const {
    const double gamma2 = -d.I1 * (d.a2 + d.a3) / (d.I2 * (d.a1 + d.a2));
    const S z = q[1] + S(gamma2) * q[0];
    return S(d.I1 * d.m3 / (d.a1 + d.a2)) * phs::cos(q[0]) + S(0.5) * S(k[0]) * z * z;
  }
};

/// Refuses a plant that somebody else made, most often one of other coordinates.
void refuse_plant(Certificate certificate) {
  for (CertificateItem& item : certificate.items())
    if (item.name.starts_with("matching"))
      item.help =
          "the plant is to have the pendulum's angle from upright and the wheel's in the world: "
          "for a model file a scene's design = \"inertia_wheel\" (C++: inertia_wheel_on), or "
          "matched_loop";
  refuse_failure(certificate);
}

}  // namespace

InertiaWheelPendulum inertia_wheel_gains(InertiaWheelPendulum d, double bandwidth,
                                         double damping_ratio) {
  const Requirement need("inertia-wheel pendulum");
  need(d.I1 > 0 && d.I2 > 0 && d.m3 > 0, "I1, I2, m3 > 0", {d.I1, d.I2, d.m3});
  need(bandwidth > 0 && damping_ratio > 0, "bandwidth and damping ratio > 0",
       {bandwidth, damping_ratio});
  const double w2 = bandwidth * bandwidth, b = 2 * damping_ratio * bandwidth;
  const double c3 = 2 * b, c2 = 2 * w2 + b * b, c1 = 2 * b * w2, c0 = w2 * w2;
  // u = K1 q1 + K2 q2 + D1 q1' + D2 q2' with these poles needs K2 and D2; K1 and D1 stand in a1 and
  // a2 + a3. M_d may be scaled: α = 1.
  const double K2 = c0 * d.I1 * d.I2 / d.m3, D2 = c1 * d.I1 * d.I2 / d.m3;
  const double sum = 1 + c3 * d.m3 / (c1 * d.I1);  // a2 + a3
  d.a1 = d.I1 * (c2 - c0 * c3 / c1) / d.m3;
  d.a2 = -1 - d.a1;
  d.a3 = sum - d.a2;
  const double determinant = d.a1 * d.a3 - d.a2 * d.a2;
  d.k1 = K2 * d.I2 / determinant;
  d.kv = D2 * determinant / d.I2;
  return d;
}

PlantPtr inertia_wheel_plant(const InertiaWheelPendulum& d) {
  return plant(InertiaWheelForm{.I1 = d.I1, .I2 = d.I2, .m3 = d.m3});
}

LoopPtr inertia_wheel_pendulum(const InertiaWheelPendulum& d, PlantPtr p,
                               std::optional<MatchingOptions> options) {
  const Requirement need("inertia-wheel pendulum");
  need(d.I1 > 0 && d.I2 > 0 && d.m3 > 0, "I1, I2, m3 > 0", {d.I1, d.I2, d.m3});
  need(d.a1 > 0 && d.a1 * d.a3 > d.a2 * d.a2, "a1 > 0 and a1 a3 > a2²", {d.a1, d.a2, d.a3});
  need(d.a1 + d.a2 < 0, "a1 + a2 < 0, or V_d has no minimum at the top", {d.a1, d.a2});
  need(d.k1 > 0, "k1 > 0", {d.k1});
  if (!options) options = MatchingOptions{.region = {{-3.2, -20}, {3.2, 20}, 20}};
  const bool refuse_here = p && options->refuse;
  if (refuse_here) options->refuse = false;
  if (!p) p = inertia_wheel_plant(d);
  const auto loop =
      std::make_shared<MatchedLoop>(p, shaping(InertiaWheelDesign{.d = d}),
                                    std::vector<std::string>{p->description().ports[0].name},
                                    std::vector<double>{0, 0}, *options);
  if (refuse_here) refuse_plant(loop->certificate());
  return loop;
}

}  // namespace porthos::energy_shaping
