#include "energy_shaping/elastic/motor_regulator.h"

#include <fmt/format.h>

#include <algorithm>

#include "energy_shaping/loop/closed_loop.h"
#include "energy_shaping/loop/derivatives.h"
#include "energy_shaping/loop/modes.h"
#include "mechanics/crba.h"
#include "phs/linear_algebra/linear_algebra.h"

namespace porthos::energy_shaping {

std::vector<double> MotorRegulator::loads(const mechanics::MechanicalModel& model,
                                          const std::vector<double>& q) {
  const size_t n = q.size();
  auto x = q;
  x.resize(2 * n, 0.0);
  std::vector<double> e(2 * n);
  model.instantiate<double>()->gradient(x, e);
  e.resize(n);
  return e;
}

MotorRegulator::MotorRegulator(const mechanics::MechanicalModel& model,
                               std::vector<SprungJoint> joints, const std::vector<double>& rest)
    : joints_(std::move(joints)) {
  phs::refuse_constraints(model.description(), "a regulator of motors with springs");
  for (const auto& c : model.mechanism().coordinates())
    if (c.nq != 1)
      throw InvalidArgument(
          "a regulator of motors with springs takes joints of one degree of freedom; '" + c.joint +
          "' has several");
  require_size("rest", rest.size(), size_t(model.mechanism().nq()));
  for (const SprungJoint& j : joints_) {
    at_.push_back(size_t(port_offsets(model.description(), {j.port})[0]));
    if (!(j.kp > 0 && j.kd > 0 && j.motor > 0))
      throw InvalidArgument(fmt::format(
          "the motor at '{}' has kp = {:g}, kd = {:g} and inertia {:g}, expected all above 0",
          j.port, j.kp, j.kd, j.motor));
  }
  certificate_ = Certificate("motors with springs of '" + model.description().name + "'");
  check(model, rest);
  refuse_failure(certificate_);
}

void MotorRegulator::check(const mechanics::MechanicalModel& model,
                           const std::vector<double>& rest) {
  const size_t n = rest.size(), m = joints_.size(), N = n + m;
  const auto g = loads(model, rest);
  const auto names = coordinate_names(model.description());
  double scale = 1e-300;
  UnheldForce left;
  for (size_t k = 0; k < n; ++k) {
    scale = std::max(scale, std::fabs(g[k]));
    if (std::ranges::find(at_, k) == at_.end()) left.take(g[k], names[k]);
  }
  for (const size_t k : at_) load_.push_back(g[k]);
  left.certify(certificate_, scale, 1e-9,
               "loads at rest of joints without a spring, over the largest",
               "give it a motor, or state a rest where nothing loads it", rest);
  certificate_.report(
      "loads", scale,
      "g(q_d) of the motors at " + listed(at_, [&](size_t k) { return names[k]; }) + " [N m]",
      load_);

  auto x = rest;
  x.resize(2 * n, 0.0);
  const auto H = hessian(model, x);
  mechanics::Workspace<double> w(model.mechanism());
  std::vector<double> M(n * n), S(N * N, 0.0), D(N, 0.0);  // S: Hessian of H_d in (q, θ)
  mechanics::crba<double>(model.mechanism(), w, rest, M);
  for (const auto& p : model.mechanism().joint_properties()) D[size_t(p.v)] = p.damping;
  for (size_t i = 0; i < n; ++i)
    for (size_t j = 0; j < n; ++j) S[i * N + j] = H[i * 2 * n + j];
  for (size_t j = 0; j < m; ++j) {
    const double K = joints_[j].stiffness;
    const size_t q = at_[j], theta = n + j;
    S[q * N + q] += K;
    S[q * N + theta] -= K;
    S[theta * N + q] -= K;
    S[theta * N + theta] += K + joints_[j].kp;
    D[theta] = joints_[j].kd;
  }
  const auto [least, softest] = phs::definiteness(N, S);
  certificate_.at_least("Hessian of H_d > 0", least, 1e-9,
                        "at the rest point, least eigenvalue, its diagonal 1: the softest is '" +
                            names.at(softest < n ? softest : at_[softest - n]) + "'");
  // (q, θ)'' = -mass⁻¹ (S (q, θ) + D (q, θ)')
  std::vector<double> A(4 * N * N, 0.0);
  for (size_t k = 0; k < N; ++k) {
    A[k * 2 * N + N + k] = 1;
    std::vector<double> stiff(N), damp(N, 0.0);
    for (size_t i = 0; i < N; ++i) stiff[i] = S[i * N + k];
    damp[k] = D[k];
    const auto through = [&](const std::vector<double>& force, size_t column) {
      const auto a = phs::linear_solve(n, M, std::span(force).first(n));
      for (size_t i = 0; i < N; ++i)
        A[(N + i) * 2 * N + column] = -(i < n ? a[i] : force[i] / joints_[i - n].motor);
    };
    through(stiff, k);
    through(damp, N + k);
  }
  certify_modes(certificate_, phs::eigenvalues(2 * N, A), 1e-9,
                "real part, of the loop linearised at rest, without friction of motors "
                "[1/s]");
}

phs::LawPtr MotorRegulator::law(size_t joint, size_t theta) const {
  return phs::law(
      [j = joints_.at(joint), g = load_.at(joint), theta](auto, auto x, auto y, auto u) {
        using T = typename decltype(u)::value_type;
        u[0] = T(g) - T(j.kp) * (x[theta] - T(j.theta)) - T(j.kd) * y[0];
        if (j.limit < HUGE_VAL) u[0] = phs::max(phs::min(u[0], T(j.limit)), T(-j.limit));
      });
}

}  // namespace porthos::energy_shaping
