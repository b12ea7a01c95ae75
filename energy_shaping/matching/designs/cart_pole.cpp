#include "energy_shaping/matching/designs.h"
#include "energy_shaping/matching/designs/require.h"
#include "energy_shaping/matching/plant.h"

namespace porthos::energy_shaping {
namespace {

struct CartPoleForm {
  static constexpr int n = 2, m = 1;
  double a, b;
  const char* name = "cart-pole after partial linearisation";
  std::array<std::pair<const char*, const char*>, 2> coordinates{{{"pole", "rad"}, {"cart", "m"}}};
  std::array<const char*, 1> inputs{"cart"};
  template <class S>
  void mass(std::span<const S>, std::span<S> M) const {
    M[0] = M[3] = S(1.0);
    M[1] = M[2] = S(0.0);
  }
  template <class S>
  S potential(std::span<const S> q) const {
    return S(a) * phs::cos(q[0]);
  }
  template <class T>
  void input(std::span<const T> q, std::span<T> G) const {
    G[0] = T(-b) * phs::cos(q[0]);
    G[1] = T(1.0);
  }
};

struct CartPoleDesign {
  static constexpr int n = 2;
  CartPole d;
  std::string name = "cart-pole";
  std::vector<Gain> gains() const { return {{"k", d.k}, {"m22", d.m22}, {"P", d.P}, {"kv", d.kv}}; }
  template <class S, class T>
  void mass(std::span<const S> q, std::span<const T> gain, std::span<S> Md) const {
    const S c = phs::cos(q[0]), k(gain[0]), m22(gain[1]);
    Md[0] = k * S(d.b * d.b / 3) * c * c * c;
    Md[1] = Md[2] = -(k * S(d.b / 2) * c * c);
    Md[3] = k * c + m22;
  }
  template <class S, class T>
  S potential(std::span<const S> q, std::span<const T> gain) const {
    using phs::asinh;  // log(sec + tan) = asinh(tan)
    const S c = phs::cos(q[0]), s = phs::sin(q[0]), k(gain[0]), m22(gain[1]), P(gain[2]);
    const S z = q[1] - S(d.q2_rest) + S(3 / d.b) * asinh(s / c) + S(6 / d.b) * m22 / k * s / c;
    return S(3 * d.a / (d.b * d.b)) / (k * c * c) + S(0.5) * P * z * z;
  }
  template <class T>
  void skew(std::span<const T> q, std::span<const T> p, std::span<const T> gain,
            std::span<T> J2) const {
    const T c = phs::cos(q[0]), s = phs::sin(q[0]), k = gain[0], m22 = gain[1], b(d.b);
    const T j = b * k * s * c *
                (b * k * p[1] * c * c + T(3.0) * k * p[0] * c + T(6.0) * m22 * p[0]) /
                (T(6.0) * (k * c + T(4.0) * m22));
    J2[0] = J2[3] = T(0.0);
    J2[1] = j;
    J2[2] = -j;
  }
};

}  // namespace

PlantPtr cart_pole_plant(const CartPole& d) { return plant(CartPoleForm{.a = d.a, .b = d.b}); }

LoopPtr cart_pole(const CartPole& d, PlantPtr p, std::optional<MatchingOptions> options) {
  const Requirement need("cart-pole");
  need(d.a > 0 && d.b > 0, "a, b > 0", {d.a, d.b});
  need(d.k > 0 && d.m22 > 0 && d.P > 0, "k, m22, P > 0", {d.k, d.m22, d.P});
  if (!p) p = cart_pole_plant(d);
  if (!options)
    options = MatchingOptions{.region = {{-1.45, d.q2_rest - 10}, {1.45, d.q2_rest + 10}, 3}};
  return std::make_shared<MatchedLoop>(p, shaping(CartPoleDesign{.d = d}),
                                       std::vector<std::string>{p->description().ports[0].name},
                                       std::vector<double>{0, d.q2_rest}, *options);
}

}  // namespace porthos::energy_shaping
