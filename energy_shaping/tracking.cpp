#include "energy_shaping/tracking.h"

#include <algorithm>
#include <cmath>

#include "mechanics/momentum.h"
#include "mechanics/rnea.h"

namespace porthos::energy_shaping {
namespace {

class RestToRest final : public Trajectory {
 public:
  RestToRest(std::vector<double> from, std::vector<double> to, double duration)
      : from_(std::move(from)), to_(std::move(to)), T_(duration) {
    require_size("end coordinates", to_.size(), from_.size());
    if (!(T_ > 0)) throw InvalidArgument("a motion from rest to rest needs a duration > 0");
  }
  void at(double t, std::span<double> q, std::span<double> v, std::span<double> a) const override {
    const double s = std::clamp(t / T_, 0.0, 1.0), r = 1 - s;
    const double p = s * s * s * s * (35 + s * (-84 + s * (70 - 20 * s)));
    const double dp = 140 * s * s * s * r * r * r / T_;
    const double ddp = 420 * s * s * r * r * (1 - 2 * s) / (T_ * T_);
    for (size_t i = 0; i < from_.size(); ++i) {
      const double way = to_[i] - from_[i];
      q[i] = from_[i] + way * p, v[i] = way * dp, a[i] = way * ddp;
    }
  }

 private:
  std::vector<double> from_, to_;
  double T_;
};

class Sines final : public Trajectory {
 public:
  Sines(std::vector<double> c, std::vector<double> a, std::vector<double> f)
      : c_(std::move(c)), a_(std::move(a)), f_(std::move(f)) {
    require_size("amplitudes", a_.size(), c_.size());
    require_size("frequencies", f_.size(), c_.size());
  }
  void at(double t, std::span<double> q, std::span<double> v, std::span<double> a) const override {
    for (size_t i = 0; i < c_.size(); ++i) {
      const double w = 2 * std::acos(-1.0) * f_[i];
      q[i] = c_[i] + a_[i] * std::sin(w * t);
      v[i] = a_[i] * w * std::cos(w * t), a[i] = -a_[i] * w * w * std::sin(w * t);
    }
  }

 private:
  std::vector<double> c_, a_, f_;
};

}  // namespace

std::shared_ptr<const Trajectory> rest_to_rest(std::vector<double> from, std::vector<double> to,
                                               double duration) {
  return std::make_shared<RestToRest>(std::move(from), std::move(to), duration);
}

std::shared_ptr<const Trajectory> sines(std::vector<double> centre, std::vector<double> amplitude,
                                        std::vector<double> frequency_Hz) {
  return std::make_shared<Sines>(std::move(centre), std::move(amplitude), std::move(frequency_Hz));
}

PdPlus::PdPlus(std::shared_ptr<const mechanics::MechanicalModel> plant,
               std::shared_ptr<const Trajectory> trajectory, std::vector<double> kp,
               std::vector<double> kd)
    : plant_(std::move(plant)),
      trajectory_(std::move(trajectory)),
      kp_(std::move(kp)),
      kd_(std::move(kd)),
      w_(plant_->mechanism()),
      n_(size_t(plant_->mechanism().nv())) {
  for (const auto& c : plant_->mechanism().coordinates())
    if (c.nq != 1)
      throw InvalidArgument("PD+ takes joints of one freedom; '" + c.joint + "' has " +
                            std::to_string(c.nv));
  require_size("kp", kp_.size(), n_);
  require_size("kd", kd_.size(), n_);
  for (size_t i = 0; i < n_; ++i)
    if (!(kp_[i] > 0) || !(kd_[i] > 0))
      throw InvalidArgument("PD+ needs kp > 0 and kd > 0; joint " + std::to_string(i) + " has " +
                            std::to_string(kp_[i]) + " and " + std::to_string(kd_[i]));
  for (auto* v : {&q_, &v_, &a_, &e_, &de_, &sum_, &both_, &first_, &second_, &zero_})
    v->resize(n_, 0.0);
}

void PdPlus::compare(double t, std::span<const double> x) {
  trajectory_->at(t, q_, v_, a_);
  mechanics::rates_from_momenta<double>(plant_->mechanism(), w_, x.first(n_), x.subspan(n_));
  rate_ = w_.rate;
  for (size_t i = 0; i < n_; ++i) e_[i] = x[i] - q_[i], de_[i] = rate_[i] - v_[i];
}

void PdPlus::law(double t, std::span<const double> x, std::span<double> u) {
  const auto& m = plant_->mechanism();
  compare(t, x);
  // b(v) = C(q, v) v + ∂V/∂q is quadratic in v; C(q, q') q_d' is its polar form, with Christoffel's symbols.
  const auto q = x.first(n_);
  for (size_t i = 0; i < n_; ++i) sum_[i] = 0.5 * (rate_[i] + v_[i]);
  mechanics::rnea<double>(m, w_, q, sum_, a_, {}, both_);
  for (size_t i = 0; i < n_; ++i) sum_[i] = 0.5 * (rate_[i] - v_[i]);
  mechanics::rnea<double>(m, w_, q, sum_, {}, {}, first_);
  mechanics::rnea<double>(m, w_, q, {}, {}, {}, second_);
  for (double& y : u) y = 0;
  for (size_t i = 0; i < n_; ++i)  // M a + C v_d + ∂V: the two polar terms, gravity put back
    u[i] = both_[i] - first_[i] + second_[i] - kp_[i] * e_[i] - kd_[i] * de_[i];
  for (const auto& j : m.joint_properties())
    u[size_t(j.v)] += j.stiffness * (x[size_t(j.q)] - j.rest) + j.damping * rate_[size_t(j.v)];
}

double PdPlus::error_energy(double t, std::span<const double> x) {
  compare(t, x);
  mechanics::momenta_from_rates<double>(plant_->mechanism(), w_, x.first(n_), de_, first_);
  double H = 0;
  for (size_t i = 0; i < n_; ++i) H += 0.5 * de_[i] * first_[i] + 0.5 * kp_[i] * e_[i] * e_[i];
  return H;
}

double PdPlus::error_power(double t, std::span<const double> x) {
  compare(t, x);
  double P = 0;
  for (size_t i = 0; i < n_; ++i) P += kd_[i] * de_[i] * de_[i];
  return P;
}

double PdPlus::error(double t, std::span<const double> x) {
  compare(t, x);
  double worst = 0;
  for (const double e : e_) worst = std::max(worst, std::fabs(e));
  return worst;
}

}  // namespace porthos::energy_shaping
