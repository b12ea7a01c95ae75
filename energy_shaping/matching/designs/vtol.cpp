#include "energy_shaping/matching/designs.h"
#include "energy_shaping/matching/designs/require.h"
#include "energy_shaping/matching/plant.h"

namespace porthos::energy_shaping {
namespace {

struct VtolForm {
  static constexpr int n = 3, m = 2;
  double epsilon, g;
  const char* name = "VTOL aircraft after an input change";
  std::array<std::pair<const char*, const char*>, 3> coordinates{
      {{"x", "m"}, {"y", "m"}, {"theta", "rad"}}};
  std::array<const char*, 2> inputs{"u1", "u2"};
  template <class S>
  void mass(std::span<const S>, std::span<S> M) const {
    for (size_t i = 0; i < 9; ++i) M[i] = S(i % 4 == 0 ? 1.0 : 0.0);
  }
  template <class S>
  S potential(std::span<const S> q) const {
    return S(g / epsilon) * phs::cos(q[2]);
  }
  template <class T>
  void input(std::span<const T> q, std::span<T> G) const {
    G[0] = G[3] = T(1.0);
    G[1] = G[2] = T(0.0);
    G[4] = phs::cos(q[2]) / T(epsilon);
    G[5] = phs::sin(q[2]) / T(epsilon);
  }
};

struct VtolDesign {
  static constexpr int n = 3;
  static constexpr bool solve_skew = true;
  Vtol d;
  std::string name = "strongly coupled VTOL";
  std::vector<Gain> gains() const { return {{"P", d.P}, {"kv", d.kv}}; }
  template <class S, class T>
  void mass(std::span<const S> q, std::span<const T>, std::span<S> Md) const {
    const S c = phs::cos(q[2]), s = phs::sin(q[2]), ke(d.k1 * d.epsilon), k1(d.k1), k3(d.k3);
    Md[0] = ke * c * c + k3;
    Md[1] = Md[3] = ke * c * s;
    Md[2] = Md[6] = k1 * c;
    Md[4] = k3 - ke * c * c;
    Md[5] = Md[7] = k1 * s;
    Md[8] = S(d.k2);
  }
  template <class S, class T>
  S potential(std::span<const S> q, std::span<const T> gain) const {
    const double e = d.k1 - d.k2 * d.epsilon;
    const S c = phs::cos(q[2]), s = phs::sin(q[2]);
    const S z1 = q[0] - S(d.x_rest) - S(d.k3 / e) * s;
    const S z2 = q[1] - S(d.y_rest) + S((d.k3 - d.k1 * d.epsilon) / e) * (c - S(1.0));
    return S(0.5) * S(gain[0]) * (z1 * z1 + z2 * z2) - S(d.g / e) * c;
  }
};

}  // namespace

PlantPtr vtol_plant(const Vtol& d) { return plant(VtolForm{.epsilon = d.epsilon, .g = d.g}); }

LoopPtr vtol(const Vtol& d, PlantPtr p, std::optional<MatchingOptions> options) {
  const Requirement need("strongly coupled VTOL");
  need(d.epsilon > 0 && d.g > 0 && d.k1 > 0 && d.P > 0, "epsilon, g, k1, P > 0",
       {d.epsilon, d.g, d.k1, d.P});
  need(d.k3 > 5 * d.k1 * d.epsilon, "k3 > 5 k1 epsilon", {d.k3, 5 * d.k1 * d.epsilon});
  need(d.k1 / d.epsilon > d.k2 && d.k2 > d.k1 / (2 * d.epsilon), "k1/epsilon > k2 > k1/(2 epsilon)",
       {d.k1 / d.epsilon, d.k2});
  if (!p) p = vtol_plant(d);
  if (!options)
    options = MatchingOptions{
        .region = {{d.x_rest - 10, d.y_rest - 10, -3.2}, {d.x_rest + 10, d.y_rest + 10, 3.2}, 2}};
  std::vector<std::string> ports;
  for (const auto& port : p->description().ports) ports.push_back(port.name);
  return std::make_shared<MatchedLoop>(p, shaping(VtolDesign{.d = d}), ports,
                                       std::vector<double>{d.x_rest, d.y_rest, 0}, *options);
}

}  // namespace porthos::energy_shaping
