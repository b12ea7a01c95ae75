#include "energy_shaping/matching/designs.h"
#include "energy_shaping/matching/designs/require.h"
#include "energy_shaping/matching/plant.h"

namespace porthos::energy_shaping {
namespace {

constexpr double sqrt2 = 1.41421356237309504880;

struct BallAndBeamForm {
  static constexpr int n = 2, m = 1;
  double L, g;
  const char* name = "ball and beam";
  std::array<std::pair<const char*, const char*>, 2> coordinates{{{"ball", "m"}, {"beam", "rad"}}};
  std::array<const char*, 1> inputs{"beam"};
  template <class S>
  void mass(std::span<const S> q, std::span<S> M) const {
    M[0] = S(1.0);
    M[1] = M[2] = S(0.0);
    M[3] = S(L * L) + q[0] * q[0];
  }
  template <class S>
  S potential(std::span<const S> q) const {
    return S(g) * q[0] * phs::sin(q[1]);
  }
  template <class T>
  void input(std::span<const T>, std::span<T> G) const {
    G[0] = T(0.0);
    G[1] = T(1.0);
  }
};

struct BallAndBeamDesign {
  static constexpr int n = 2;
  BallAndBeam d;
  std::string name = "ball and beam";
  std::vector<Gain> gains() const { return {{"kp", d.kp}, {"kv", d.kv}}; }
  template <class S, class T>
  void mass(std::span<const S> q, std::span<const T>, std::span<S> Md) const {
    using phs::sqrt;
    const S s = S(d.L * d.L) + q[0] * q[0], root = sqrt(s);
    Md[0] = S(sqrt2) * root;
    Md[1] = Md[2] = s;
    Md[3] = S(sqrt2) * s * root;
  }
  template <class S, class T>
  S potential(std::span<const S> q, std::span<const T> k) const {
    using phs::asinh;
    const S z = q[1] - asinh(q[0] / S(d.L)) / S(sqrt2);
    const S half = phs::sin(S(0.5) * q[1]);  // 1 - cos q2 with small relative error
    return S(2 * d.g) * half * half + S(0.5) * S(k[0]) * z * z;
  }
  template <class T>
  void skew(std::span<const T> q, std::span<const T> p, std::span<const T>, std::span<T> J2) const {
    using phs::sqrt;
    const T j = q[0] * (p[0] - T(sqrt2) * p[1] / sqrt(T(d.L * d.L) + q[0] * q[0]));
    J2[0] = J2[3] = T(0.0);
    J2[1] = j;
    J2[2] = -j;
  }
};

}  // namespace

PlantPtr ball_and_beam_plant(const BallAndBeam& d) {
  return plant(BallAndBeamForm{.L = d.L, .g = d.g});
}

LoopPtr ball_and_beam(const BallAndBeam& d, PlantPtr p, std::optional<MatchingOptions> options) {
  const Requirement need("ball and beam");
  need(d.L > 0 && d.g > 0 && d.kp > 0, "L, g, kp > 0", {d.L, d.g, d.kp});
  if (!p) p = ball_and_beam_plant(d);
  if (!options) options = MatchingOptions{.region = {{-d.L, -1.5}, {d.L, 1.5}, 2}};
  return std::make_shared<MatchedLoop>(p, shaping(BallAndBeamDesign{.d = d}),
                                       std::vector<std::string>{p->description().ports[0].name},
                                       std::vector<double>{0, 0}, *options);
}

}  // namespace porthos::energy_shaping
