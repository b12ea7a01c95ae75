#include "energy_shaping/elastic/structure_preserving_regulator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "energy_shaping/elastic/detail/link_motion.h"
#include "energy_shaping/loop/closed_loop.h"
#include "energy_shaping/loop/modes.h"
#include "energy_shaping/loop/port_law.h"
#include "mechanics/crba.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "phs/system/random_state.h"

namespace porthos::energy_shaping {
namespace {

using PreservedParts = StructurePreservingRegulator::Parts;

/// The law at (q, p, θ, θ'), with η and its rate.
template <class T>
class PreservingLaw {
  using In = std::span<const T>;

 public:
  explicit PreservingLaw(const std::shared_ptr<const PreservedParts>& parts)
      : eta(parts->K.size()),
        eta_rate(eta.size()),
        u(eta.size()),
        p_(parts),
        links_(parts->model->mechanism(), parts->K) {}

  void at(In q, In p, In theta, In theta_rate) {
    links_.at(q, p, theta, theta_rate);
    for (size_t i = 0; i < u.size(); ++i) {
      const T D(p_->D[i]), K(p_->K[i]), B(p_->B[i]);
      const T n = links_.load[i] - D * links_.v[i], n_rate = links_.load_rate[i] - D * links_.a[i],
              n_second = links_.load_second[i] - D * links_.jerk[i];
      eta[i] = theta[i] - n / K;
      eta_rate[i] = theta_rate[i] - n_rate / K;
      u[i] = n + B * n_second / K - T(p_->Ke[i]) * (eta[i] - T(p_->rest[i])) -
             T(p_->De[i]) * eta_rate[i];
    }
  }

  std::vector<T> eta, eta_rate, u;

 private:
  std::shared_ptr<const PreservedParts> p_;
  LinkMotion<T> links_;
};

struct MotorLaws {
  std::shared_ptr<const PreservedParts> parts;
  std::vector<size_t> at;
  std::vector<StructurePreservingRegulator::MotorPlace> motors;

  template <class T>
  auto evaluator() const {
    const size_t n = at.size();
    return [parts = parts, at = at, motors = motors, law = PreservingLaw<T>(parts),
            theta = std::vector<T>(n), rate = std::vector<T>(n),
            n](T, std::span<const T> x, std::span<T> u) mutable {
      for (size_t k = 0; k < n; ++k) {
        theta[at[k]] = x[motors[k].theta];
        rate[at[k]] = x[motors[k].momentum] / T(parts->B[at[k]]);
      }
      law.at(x.first(n), x.subspan(n, n), theta, rate);
      for (size_t k = 0; k < n; ++k) u[k] = law.u[at[k]];
    };
  }
};

}  // namespace

StructurePreservingRegulator::StructurePreservingRegulator(
    std::shared_ptr<const mechanics::MechanicalModel> model, std::vector<PreservedJoint> joints) {
  const auto& d = model->description();
  phs::refuse_constraints(d, "elastic-structure-preserving regulation");
  for (const auto& c : model->mechanism().coordinates())
    if (c.nq != 1)
      throw InvalidArgument(
          "elastic-structure-preserving regulation takes "
          "joints of one degree of freedom; '" +
          c.joint + "' has several");
  const auto n = size_t(model->mechanism().nv());
  const std::vector<double> none(n, 0.0);
  Parts p{model, none, none, none, none, none, none};
  for (const PreservedJoint& j : joints) {
    if (!(j.stiffness > 0 && j.motor > 0 && j.gain > 0 && j.link_damping >= 0 &&
          j.motor_damping >= 0))
      throw InvalidArgument(
          fmt::format("the joint '{}' has K = {:g}, B = {:g}, Ke = {:g}, D = "
                      "{:g} and De = {:g}, expected the "
                      "first three above 0 and no damping below",
                      j.port, j.stiffness, j.motor, j.gain, j.link_damping, j.motor_damping));
    const auto k = size_t(port_offsets(d, {j.port})[0]);
    at_.push_back(k);
    p.K[k] = j.stiffness;
    p.B[k] = j.motor;
    p.rest[k] = j.rest;
    p.D[k] = j.link_damping;
    p.Ke[k] = j.gain;
    p.De[k] = j.motor_damping;
  }
  for (const auto& c : model->mechanism().coordinates())
    if (p.K[size_t(c.v)] == 0)
      throw InvalidArgument(
          fmt::format("joint '{}' has no motor behind a "
                      "spring, expected one at every joint",
                      c.name));
  parts_ = std::make_shared<const Parts>(std::move(p));
  certificate_ = Certificate("elastic structure preservation of '" + d.name + "'");
  check_motion();
  certify();
  refuse_failure(certificate_);
}

/// B η'' of the plant under the law, by dual numbers along its field, against the target's.
void StructurePreservingRegulator::check_motion() {
  const Parts& p = *parts_;
  const size_t n = p.K.size();
  const auto plant = p.model->instantiate<double>();
  PreservingLaw<double> law(parts_);
  PreservingLaw<phs::Dual> along(parts_);
  std::mt19937_64 generator(1);
  std::normal_distribution<double> spread(0, 1);
  std::vector<double> theta(n), rate(n), u(size_t(p.model->description().nu), 0.0), dx(2 * n);
  std::vector<phs::Dual> x(2 * n), motor(n), speed(n);
  double worst = 0;
  std::vector<double> at;
  for (int sample = 0; sample < 200; ++sample) {
    const auto s = phs::random_state(p.model->description(), 1, generator);
    const std::span<const double> q = std::span(s).first(n), momenta = std::span(s).subspan(n);
    for (size_t i = 0; i < n; ++i) {
      theta[i] = q[i] + 0.2 * spread(generator);
      rate[i] = spread(generator);
      u[i] = p.K[i] * (theta[i] - q[i]);
    }
    law.at(q, momenta, theta, rate);
    plant->field(0.0, s, u, dx);
    for (size_t i = 0; i < 2 * n; ++i) x[i] = {s[i], dx[i]};
    for (size_t i = 0; i < n; ++i) {
      motor[i] = {theta[i], rate[i]};
      speed[i] = {rate[i], (law.u[i] - u[i]) / p.B[i]};
    }
    along.at(std::span<const phs::Dual>(x).first(n), std::span<const phs::Dual>(x).subspan(n),
             motor, speed);
    for (size_t i = 0; i < n; ++i) {
      const double force = p.B[i] * along.eta_rate[i].d,
                   target = p.K[i] * (q[i] - law.eta[i]) - p.Ke[i] * (law.eta[i] - p.rest[i]) -
                            p.De[i] * law.eta_rate[i];
      const double off =
          std::fabs(force - target) / (std::fabs(target) + std::fabs(law.u[i]) + std::fabs(u[i]));
      if (!(off <= worst)) {
        worst = std::isnan(off) ? HUGE_VAL : off;
        at.assign(s.begin(), s.end());
      }
    }
  }
  certificate_.at_most("motors move as the target's", worst, 1e-9,
                       "B η'' along the plant's field against the target's forces, 200 states", at);
}

void StructurePreservingRegulator::certify() {
  const Parts& p = *parts_;
  const auto& m = p.model->mechanism();
  const size_t n = p.K.size(), N = 2 * n;
  PreservingLaw<double> law(parts_);
  const std::vector<double> still(n, 0.0);
  law.at(p.rest, still, p.rest, still);
  std::vector<double> twist(n), D0(n, 0.0);
  for (size_t i = 0; i < n; ++i) twist[i] = p.rest[i] - law.eta[i];  // K⁻¹ g(q_d)
  double most = 0;
  for (const double t : twist) most = std::max(most, std::fabs(t));
  certificate_.report(
      "springs at rest", most,
      "θ - q_d of " +
          listed(coordinate_names(p.model->description()), [](const auto& name) { return name; }) +
          ", which carries the load [rad]",
      twist);

  // The target linearised at rest: (q, η)'' = -mass⁻¹ (S (q, η) + D (q, η)').
  for (const auto& j : m.joint_properties()) D0[size_t(j.v)] = j.damping;
  mechanics::Workspace<double> w(m);
  std::vector<double> M(n * n), A(4 * N * N, 0.0);
  mechanics::crba<double>(m, w, p.rest, M);
  for (size_t k = 0; k < N; ++k) {
    const size_t i = k % n;
    A[k * 2 * N + N + k] = 1;
    std::vector<double> stiff(N, 0.0), damp(N, 0.0);
    stiff[i] = k < n ? p.K[i] : -p.K[i];
    stiff[n + i] = k < n ? -p.K[i] : p.K[i] + p.Ke[i];
    damp[k] = k < n ? p.D[i] + D0[i] : p.De[i];
    const auto through = [&](const std::vector<double>& force, size_t column) {
      const auto a = phs::linear_solve(n, M, std::span(force).first(n));
      for (size_t r = 0; r < N; ++r)
        A[(N + r) * 2 * N + column] = -(r < n ? a[r] : force[r] / p.B[r - n]);
    };
    through(stiff, k);
    through(damp, N + k);
  }
  certify_modes(certificate_, phs::eigenvalues(2 * N, A), 1e-9,
                "real part, of the target linearised at rest [1/s]");
}

std::vector<phs::LawPtr> StructurePreservingRegulator::laws(
    const std::vector<MotorPlace>& motors) const {
  require_size("motors", motors.size(), at_.size());
  const auto shared =
      std::make_shared<const SharedLaw<MotorLaws>>(MotorLaws{parts_, at_, motors}, at_.size());
  std::vector<phs::LawPtr> all;
  for (size_t k = 0; k < at_.size(); ++k)
    all.push_back(phs::law([shared, k](auto t, auto x, auto, auto u) { (*shared)(t, x, k, u); }));
  return all;
}

}  // namespace porthos::energy_shaping
