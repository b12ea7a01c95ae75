#include <fmt/format.h>

#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <numeric>
#include <optional>
#include <random>

#include "energy_shaping/loop/derivatives.h"
#include "energy_shaping/loop/held_loop.h"
#include "energy_shaping/matching/detail/matching_rest.h"
#include "energy_shaping/matching/numerical_matching.h"
#include "phs/linear_algebra/linear_algebra.h"

namespace porthos::energy_shaping {
namespace {

using Numbers = std::array<double, 4>;  ///< of a characteristic polynomial

/// The loop of a numerical matching linearised at its rest point, in closed form: M_d is known
/// there, and λ·∂V_d = ∂V/∂r gives the Hessian of V_d.
class MatchedAtRest {
 public:
  /// bandwidth: of a ratio that is 0
  MatchedAtRest(const phs::Model& plant, const NumericalMatching& o, double bandwidth)
      : o_(o), r_(size_t(o.unactuated)), s_(1 - r_) {
    const std::vector<double> x{o.rest[0], o.rest[1], 0, 0};
    const LinearPlant of = linear_plant(plant, x);
    const auto H = hessian(plant, x);
    K_rr_ = H[5 * r_];
    K_rs_ = H[4 * r_ + s_];
    for (size_t i = 0; i < 2; ++i)
      for (size_t j = 0; j < 2; ++j) {
        inverse_[2 * i + j] = of.A(int(i), int(2 + j));
        friction_[2 * i + j] = of.A(int(2 + i), int(2 + j));
      }
    const double det = inverse_[0] * inverse_[3] - inverse_[1] * inverse_[2];
    M_rr_ = inverse_[3 * s_] / det;
    M_ss_ = inverse_[3 * r_] / det;
    M_rs_ = -inverse_[1] / det;
    // on s = ρ r, which ku and kv lead to, (M_rr + ρ M_rs) r'' = -(K_rr + ρ K_rs) r
    const double w2 = bandwidth * bandwidth;
    if (o_.ratio == 0) o_.ratio = (K_rr_ - w2 * M_rr_) / (w2 * M_rs_ - K_rs_);
    const double F = o_.ratio * M_rs_ + M_rr_;
    lambda_ = F > 0 ? o.scale : -o.scale;
  }
  double ratio() const { return o_.ratio; }
  /// (M_d)_ss for det M_d / M_d_rr of the plant's size, and a stiffness of its gravity's.
  double size_of_mass() const { return o_.scale * std::fabs(M_ss_ - M_rs_ * M_rs_ / M_rr_); }
  double size_of_stiffness() const { return (std::fabs(K_rr_) + std::fabs(K_rs_)) / o_.scale; }

  /// How far the characteristic polynomial is from that of ω and ζ twice, logarithms of its
  /// numbers; none where the rest point does not attract.
  std::optional<Numbers> logs(double ku, double kv, double determinant, double bandwidth,
                              double ratio) const {
    const double rho = o_.ratio, d_rr = lambda_ * (rho * M_rs_ + M_rr_),
                 d_rs = lambda_ * (rho * M_ss_ + M_rs_);
    std::array<double, 4> Md{}, Kd{};
    Md[3 * r_] = d_rr;
    Md[1] = Md[2] = d_rs;
    Md[3 * s_] = d_rs * d_rs / d_rr + determinant;
    Kd[3 * r_] = (K_rr_ - rho * K_rs_) / lambda_ + ku * rho * rho;
    Kd[1] = Kd[2] = K_rs_ / lambda_ - ku * rho;
    Kd[3 * s_] = ku;
    if (!(Kd[3 * r_] * Kd[3 * s_] > Kd[1] * Kd[2])) return {};
    // p' = -M_d M⁻¹ K_d q - (G kv Gᵀ M_d⁻¹ + D M⁻¹) p
    const auto product = [](const auto& a, const auto& b) {
      return std::array<double, 4>{a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3],
                                   a[2] * b[0] + a[3] * b[2], a[2] * b[1] + a[3] * b[3]};
    };
    const auto stiff = product(product(Md, inverse_), Kd);
    const double det = d_rr * determinant;
    std::vector<double> A(16, 0.0);
    for (size_t i = 0; i < 2; ++i)
      for (size_t j = 0; j < 2; ++j) {
        A[4 * i + 2 + j] = inverse_[2 * i + j];
        A[4 * (2 + i) + j] = -stiff[2 * i + j];
        A[4 * (2 + i) + 2 + j] = friction_[2 * i + j];
      }
    A[4 * (2 + s_) + 2 + s_] -= kv * d_rr / det;
    A[4 * (2 + s_) + 2 + r_] += kv * d_rs / det;
    // s⁴ + c3 s³ + ... against (s² + 2ζω s + ω²)²: its numbers are smooth where two modes meet
    std::array<std::complex<double>, 5> c{1.0, 0.0, 0.0, 0.0, 0.0};
    for (const auto& root : phs::eigenvalues(4, A)) {
      if (!(root.real() < 0)) return {};
      for (size_t k = 4; k > 0; --k) c[k] -= root * c[k - 1];
    }
    const double w2 = bandwidth * bandwidth, z = 2 * ratio * bandwidth;
    const std::array<double, 4> wanted{2 * z, z * z + 2 * w2, 2 * z * w2, w2 * w2};
    Numbers off;
    for (size_t k = 0; k < 4; ++k) off[k] = std::log(c[k + 1].real() / wanted[k]);
    return off;
  }

 private:
  NumericalMatching o_;
  size_t r_, s_;
  std::array<double, 4> inverse_{}, friction_{};  ///< M⁻¹ and -D M⁻¹
  double K_rr_, K_rs_, M_rr_, M_rs_, M_ss_, lambda_;
};

using Decades = std::array<double, 3>;  ///< of the gains, beside their centre
using Logs = std::function<std::optional<Numbers>(const Decades&)>;

double size_of(const std::optional<Numbers>& logs) {
  return logs ? std::inner_product(logs->begin(), logs->end(), logs->begin(), 0.0) : HUGE_VAL;
}

/// Least squares of the logarithms by Levenberg and Marquardt's steps, some hundred evaluations.
/// @return their sum of squares at `at`, where it ends
double descend(const Logs& logs, Decades& at) {
  constexpr double beside = 1e-6;
  auto now = logs(at);
  double damping = 1e-3;
  for (int i = 0; i < 40 && damping < 1e9 && now && size_of(now) > 1e-24; ++i) {
    std::array<Numbers, 3> slopes;
    for (size_t k = 0; k < 3; ++k) {
      Decades moved = at;
      moved[k] += beside;
      const auto there = logs(moved);
      if (!there) return size_of(now);
      for (size_t j = 0; j < 4; ++j) slopes[k][j] = ((*there)[j] - (*now)[j]) / beside;
    }
    std::vector<double> normal(9), right(3);
    for (size_t k = 0; k < 3; ++k) {
      for (size_t l = 0; l < 3; ++l)
        normal[3 * k + l] =
            std::inner_product(slopes[k].begin(), slopes[k].end(), slopes[l].begin(), 0.0);
      right[k] = -std::inner_product(slopes[k].begin(), slopes[k].end(), now->begin(), 0.0);
      normal[4 * k] *= 1 + damping;
    }
    const auto step = phs::linear_solve(3, normal, right);
    Decades next = at;
    for (size_t k = 0; k < 3; ++k) next[k] += step[k];
    if (const auto there = logs(next); size_of(there) < size_of(now)) {
      at = next;
      now = there;
      damping /= 5;
    } else {
      damping *= 4;
    }
  }
  return size_of(now);
}

}  // namespace

void require_matching_rest(const phs::Model& plant, const NumericalMatching& o,
                           const std::string& what) {
  const auto r = size_t(o.unactuated);
  const std::vector<double> x{o.rest[0], o.rest[1], 0, 0};
  const auto H = hessian(plant, x);
  std::vector<double> slope(4);
  plant.instantiate<double>()->gradient(x, slope);
  const double stiffness = std::fabs(H[5 * r]) + std::fabs(H[4 * r + 1 - r]),
               rounding = 1e-9 / H[5 * (2 + r)];  // 1e-9 rad/s² or m/s² on its inertia
  const std::string name = coordinate_names(plant.description())[r];
  if (!(std::fabs(slope[r]) <= 1e-6 * stiffness + rounding))
    throw InvalidArgument(
        fmt::format("{}: no equilibrium at rest [{:g}, {:g}]: {:.3g} N m (N) pull '{}', which has "
                    "no actuator, expected where it balances",
                    what, o.rest[0], o.rest[1], -slope[r], name));
  if (stiffness <= rounding)
    throw InvalidArgument(
        fmt::format("{}: nothing pulls '{}', which has no actuator: the model has no gravity "
                    "there, expected some",
                    what, name));
}

NumericalMatching numerical_matching_gains(const phs::Model& plant, NumericalMatching o,
                                           double bandwidth, double damping_ratio) {
  if (plant.description().nx != 4 || (o.unactuated != 0 && o.unactuated != 1))
    throw InvalidArgument(
        "gains of a numerical matching: the plant needs two coordinates, and the unactuated one is "
        "0 or 1");
  if (!(bandwidth > 0) || !(damping_ratio > 0) || !(o.scale > 0))
    throw InvalidArgument(
        "gains of a numerical matching: bandwidth, damping ratio and scale are not above 0");
  require_matching_rest(plant, o, "gains of a numerical matching");
  const MatchedAtRest loop(plant, o, bandwidth);
  o.ratio = loop.ratio();
  const double mass = loop.size_of_mass();
  const std::array<double, 3> centre{loop.size_of_stiffness(), 2 * damping_ratio * bandwidth * mass,
                                     mass};
  const auto gain = [&](const Decades& at, size_t k) { return centre[k] * std::pow(10, at[k]); };
  const Logs logs = [&](const Decades& at) {
    return loop.logs(gain(at, 0), gain(at, 1), gain(at, 2), bandwidth, damping_ratio);
  };
  Decades best{};
  double least = HUGE_VAL;
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int begun = 0; begun < 6 && least > 1e-9; ++begun) {  // some end beside the best
    Decades near{};
    double lowest = HUGE_VAL, reach = 3;
    for (int i = 0; i < 6000; ++i) {
      const bool anywhere = i < 1000;  // then near what was found, nearer where that fails
      Decades next = anywhere ? Decades{} : near;
      for (double& x : next) x += reach * uniform(generator);
      const double off = size_of(logs(next));
      if (!anywhere) reach = off < lowest ? 2 * reach : std::fmax(0.96 * reach, 1e-6);
      if (!(off < lowest)) continue;
      lowest = off;
      near = next;
    }
    if (lowest < least) {
      least = lowest;
      best = near;
    }
  }
  // A valley beside the gains that fit ends the walk: from others by least squares.
  for (int begun = 0; begun < 2000 && least > 1e-9; ++begun) {
    Decades from{};
    for (double& x : from) x += 3 * uniform(generator);
    if (const double off = descend(logs, from); off < least) {
      least = off;
      best = from;
    }
  }
  if (least == HUGE_VAL)
    throw InvalidArgument(
        fmt::format("gains of a numerical matching: with the ratio {:g} none of 6000 makes the "
                    "rest point attract, expected another ratio, of the other sign too",
                    o.ratio));
  o.ku = gain(best, 0);
  o.kv = gain(best, 1);
  o.determinant = gain(best, 2);
  return o;
}

}  // namespace porthos::energy_shaping
