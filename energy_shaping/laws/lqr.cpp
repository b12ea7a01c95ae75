#include "energy_shaping/laws/lqr.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "energy_shaping/loop/closed_loop.h"
#include "energy_shaping/loop/derivatives.h"
#include "energy_shaping/loop/held_loop.h"
#include "energy_shaping/loop/modes.h"
#include "mechanics/crba.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "phs/linear_algebra/riccati.h"
#include "phs/scalars/trig.h"
#include "phs/system/random_state.h"

namespace porthos::energy_shaping {
namespace {

using phs::Matrix;

Matrix zeros(size_t rows, size_t cols) { return Matrix(int(rows), int(cols)); }

void check_weights(const LqrWeights& w, size_t n, size_t m) {
  require_size("position weights", w.position.size(), n);
  require_size("rate weights", w.rate.size(), n);
  require_size("effort weights", w.effort.size(), m);
  for (const auto* all : {&w.position, &w.rate})
    for (const double x : *all)
      if (!(x >= 0)) throw InvalidArgument(fmt::format("a weight is {}, expected 0 or more", x));
  for (const double x : w.effort)
    if (!(x > 0)) throw InvalidArgument(fmt::format("an effort weight is {}, expected > 0", x));
}

/// M⁻¹ W M⁻¹: rates are M⁻¹p.
Matrix weight_of_momenta(const mechanics::Mechanism& m, std::span<const double> q,
                         const std::vector<double>& rate) {
  const size_t n = rate.size();
  mechanics::Workspace<double> w(m);
  std::vector<double> M(n * n);
  mechanics::crba<double>(m, w, q, M);
  Matrix inverse = zeros(n, n), W = zeros(n, n);
  for (size_t j = 0; j < n; ++j) {
    std::vector<double> unit(n, 0.0);
    unit[j] = 1;
    const auto column = phs::linear_solve(n, M, unit);
    for (size_t i = 0; i < n; ++i) inverse(int(i), int(j)) = column[i];
    W(int(j), int(j)) = rate[j];
  }
  return transpose(inverse) * W * inverse;
}

constexpr double full_turn = 2 * std::numbers::pi;

/// An angle without its full turns.
template <class T>
T within_half_a_turn(T angle) {
  if constexpr (requires { phs::to_double(angle); })
    return angle - T(full_turn * std::round(phs::to_double(angle) / full_turn));
  else {
    const T magic(phs::trig::round_magic);
    return angle - T(full_turn) * ((angle / T(full_turn) + magic) - magic);
  }
}

double largest(const Matrix& M) {
  double most = 0;
  for (const double x : M.a) most = std::fmax(most, std::isnan(x) ? HUGE_VAL : std::fabs(x));
  return most;
}

/// What to say where Riccati's equation has no solution because no weight sees a motion that does
/// not return by itself; empty: weights do not help. Q: of (q, p), by the names of q
std::string unseen(const Matrix& A, const Matrix& B, Matrix Q, const Matrix& R,
                   const std::vector<std::string>& names) {
  std::vector<int> without;
  double weight = 0;
  for (int i = 0; i < int(names.size()); ++i) {
    weight = std::max(weight, 1e-2 * Q(i, i));
    if (Q(i, i) == 0) without.push_back(i);
  }
  if (weight == 0) weight = 1;
  const auto solved = [&] { return largest(riccati(A, B, Q, R)) < HUGE_VAL; };
  for (const int i : without) Q(i, i) = weight;
  if (without.empty() || !solved()) return {};
  std::string needed, any;  // needed: the weights of the others do not do
  for (const int i : without) {
    Q(i, i) = 0;
    add_to_list(any, "'" + names[size_t(i)] + "'");
    if (!solved()) add_to_list(needed, "'" + names[size_t(i)] + "'");
    Q(i, i) = weight;
  }
  if (needed.empty())
    return "no weight sees a motion that does not return by itself: state a small one of " + any;
  return needed.find(',') == std::string::npos
             ? "the coordinate " + needed +
                   " has no weight and does not return by itself: state a small one"
             : "the coordinates " + needed +
                   " have no weights and do not return by themselves: state small ones";
}

}  // namespace

Lqr::Lqr(std::shared_ptr<const mechanics::MechanicalModel> plant,
         std::vector<std::string> actuators, std::vector<double> rest, const LqrWeights& weights,
         std::vector<bool> periodic)
    : plant_(std::move(plant)),
      actuators_(std::move(actuators)),
      rest_(std::move(rest)),
      periodic_(std::move(periodic)) {
  const auto& d = plant_->description();
  phs::refuse_constraints(d, "an LQR");
  for (const auto& c : plant_->mechanism().coordinates())
    if (c.nq != 1)
      throw InvalidArgument("an LQR takes joints of one degree of freedom; '" + c.joint +
                            "' has several");
  require_size("rest", rest_.size(), size_t(plant_->mechanism().nq()));
  if (!periodic_.empty()) require_size("periodic", periodic_.size(), rest_.size());
  const auto at = port_offsets(d, actuators_);
  require_size("numbers of the actuators' ports", at.size(), actuators_.size());
  check_weights(weights, rest_.size(), at.size());
  rest_.resize(2 * rest_.size(), 0.0);
  periodic_.resize(rest_.size(), false);
  certificate_ = Certificate("linear-quadratic regulator of '" + d.name + "'");
  certificate_.name_coordinates(coordinate_names(d));
  balance(at);
  refuse_failure(certificate_);
  design(at, weights);
  refuse_failure(certificate_);
}

/// u* holds the plant at rest; what no actuator can hold must be zero.
void Lqr::balance(const std::vector<int>& at) {
  const auto& d = plant_->description();
  const auto f = plant_->instantiate<double>();
  const size_t n = rest_.size() / 2;
  std::vector<double> dx(2 * n);
  std::mt19937_64 generator(1);
  double scale = 1e-300;
  UnheldForce left;
  for (int i = 0; i < 100; ++i) {
    auto x = phs::random_state(d, 1.0, generator);
    std::fill(x.begin() + long(n), x.end(), 0.0);
    f->field(0.0, x, {}, dx);
    for (size_t k = n; k < 2 * n; ++k) scale = std::max(scale, std::fabs(dx[k]));
  }
  f->field(0.0, rest_, {}, dx);
  for (const int a : at) u_.push_back(-dx[n + size_t(a)]);
  for (size_t k = 0; k < n; ++k)
    if (std::find(at.begin(), at.end(), int(k)) == at.end())
      left.take(dx[n + k], certificate_.coordinates()[k]);
  left.certify(certificate_, scale, 1e-9, "at the rest point, over that of 100 random positions",
               "drive it, or state a target where it balances",
               {rest_.begin(), rest_.begin() + long(n)});
  certificate_.report("effort at rest", left.size,
                      "u* of the actuators of " +
                          listed(at, [&](int k) { return certificate_.coordinates()[size_t(k)]; }),
                      u_);
}

void Lqr::design(const std::vector<int>& at, const LqrWeights& weights) {
  const size_t n = rest_.size() / 2, m = at.size();
  const int nx = int(2 * n);
  Matrix A = zeros(2 * n, 2 * n), B = zeros(2 * n, m), Q = A, R = zeros(m, m), Ri = R;
  A.a = field_jacobian(*plant_, rest_);  // forces of joint ports do not depend on the state
  const auto Qp = weight_of_momenta(plant_->mechanism(), std::span(rest_).first(n), weights.rate);
  for (size_t i = 0; i < n; ++i) {
    Q(int(i), int(i)) = weights.position[i];
    for (size_t j = 0; j < n; ++j) Q(int(n + i), int(n + j)) = Qp(int(i), int(j));
  }
  for (size_t j = 0; j < m; ++j) {
    B(int(n) + at[j], int(j)) = 1;
    R(int(j), int(j)) = weights.effort[j];
    Ri(int(j), int(j)) = 1 / weights.effort[j];
  }
  P_ = riccati(A, B, Q, R);
  if (largest(P_) == HUGE_VAL)
    if (const auto why = unseen(A, B, Q, R, certificate_.coordinates()); !why.empty())
      throw InvalidArgument(certificate_.title() + ": " + why);
  K_ = Ri * transpose(B) * P_;
  const Matrix AP = transpose(A) * P_, PBK = P_ * B * K_, BK = B * K_;
  Matrix residual = zeros(2 * n, 2 * n), closed = residual;
  for (int i = 0; i < nx; ++i)
    for (int j = 0; j < nx; ++j) {
      residual(i, j) = AP(i, j) + AP(j, i) - PBK(i, j) + Q(i, j);
      closed(i, j) = A(i, j) - BK(i, j);
    }
  certificate_.at_most("Riccati equation",
                       largest(P_) == HUGE_VAL
                           ? HUGE_VAL
                           : largest(residual) / (largest(Q) + largest(AP) + largest(PBK)),
                       1e-9, "largest residual over its largest term; large: not stabilisable");
  const auto modes = phs::eigenvalues(size_t(nx), closed.a);
  fastest_ = HUGE_VAL;
  for (const auto& z : modes) {
    fastest_ = std::fmin(fastest_, 1 / std::abs(z));
    slowest_ = std::fmax(slowest_, -1 / z.real());
  }
  A_ = std::move(A);
  B_ = std::move(B);
  report_gains();
  certify_modes(certificate_, modes, 1e-9, "real part, of the linearised loop [1/s]");
}

/// The law by joints: p = M(q*) q' near the rest point.
void Lqr::report_gains() {
  const auto& m = plant_->mechanism();
  const size_t n = rest_.size() / 2;
  mechanics::Workspace<double> w(m);
  std::vector<double> M(n * n);
  mechanics::crba<double>(m, w, std::span<const double>(rest_).first(n), M);
  for (size_t row = 0; row < actuators_.size(); ++row) {
    std::vector<double> gains(2 * n, 0.0);
    std::string angles, rates;
    for (const auto& c : m.coordinates()) {
      const auto k = size_t(c.v);
      gains[k] = K_(int(row), int(k));
      for (size_t j = 0; j < n; ++j) gains[n + k] += K_(int(row), int(n + j)) * M[k * n + j];
      angles += fmt::format("{} {:.6g}, ", c.joint, gains[k]);
      rates += fmt::format("{}' {:.6g}, ", c.joint, gains[n + k]);
    }
    rates.resize(rates.size() - 2);
    certificate_.report("gains of " + actuators_[row], std::fabs(u_[row]),
                        "|u*|; K of u = u* - K (q - q*, q'): " + angles + rates, gains);
  }
}

void Lqr::certify_sampled(double period, int delay) {
  Certificate with = certificate_;  // a period that is refused leaves the certificate as it was
  energy_shaping::certify_sampled(with, {A_, B_, K_}, period, delay);
  refuse_failure(with);
  certificate_ = std::move(with);
}

double Lqr::error(std::span<const double> x, size_t k) const {
  const double e = x[k] - rest_[k];
  return periodic_[k] ? std::remainder(e, full_turn) : e;
}

double Lqr::cost_to_go(std::span<const double> x) const {
  double V = 0;
  for (size_t i = 0; i < rest_.size(); ++i) {
    double row = 0;
    for (size_t j = 0; j < rest_.size(); ++j) row += P_(int(i), int(j)) * error(x, j);
    V += error(x, i) * row;
  }
  return V;
}

std::vector<PortLaw> Lqr::port_laws(const std::vector<double>& limits) const {
  if (!limits.empty()) require_size("limits", limits.size(), actuators_.size());
  std::vector<PortLaw> laws;
  for (size_t j = 0; j < actuators_.size(); ++j) {
    const long nx = long(rest_.size());
    const std::vector<double> row(K_.a.begin() + long(j) * nx, K_.a.begin() + long(j + 1) * nx);
    const double limit = limits.empty() ? HUGE_VAL : limits[j];
    laws.push_back({actuators_[j],
                    phs::law([row, limit, rest = rest_, hold = u_[j], turns = periodic_](
                                 auto, auto x, auto, auto u) {
                      using T = typename decltype(u)::value_type;
                      T sum(hold);
                      for (size_t k = 0; k < row.size(); ++k) {
                        const T e = x[k] - T(rest[k]);
                        sum = sum - T(row[k]) * (turns[k] ? within_half_a_turn(e) : e);
                      }
                      if (limit < HUGE_VAL) sum = phs::max(phs::min(sum, T(limit)), T(-limit));
                      u[0] = sum;
                    }),
                    limit});
  }
  return laws;
}

}  // namespace porthos::energy_shaping
