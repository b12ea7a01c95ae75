#include "energy_shaping/laws/tracking.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "mechanics/momentum.h"
#include "mechanics/rnea.h"

namespace porthos::energy_shaping {
namespace {

class RestToRest final : public TrajectoryFor<RestToRest> {
 public:
  RestToRest(std::vector<double> from, std::vector<double> to, double duration)
      : from_(std::move(from)), to_(std::move(to)), T_(duration) {
    require_size("end coordinates", to_.size(), from_.size());
    if (!(T_ > 0)) throw InvalidArgument("a motion from rest to rest needs a duration > 0");
  }
  size_t size() const override { return from_.size(); }
  template <class T>
  void motion(T t, std::span<T> q, std::span<T> v, std::span<T> a) const {
    const T s = phs::max(phs::min(t / T(T_), T(1.0)), T(0.0)), r = T(1.0) - s;
    const T p = s * s * s * s * (T(35.0) + s * (T(-84.0) + s * (T(70.0) - T(20.0) * s)));
    const T dp = T(140.0) * s * s * s * r * r * r / T(T_);
    const T ddp = T(420.0) * s * s * r * r * (T(1.0) - T(2.0) * s) / T(T_ * T_);
    for (size_t i = 0; i < from_.size(); ++i) {
      const T way = T(to_[i] - from_[i]);
      q[i] = T(from_[i]) + way * p;
      v[i] = way * dp;
      a[i] = way * ddp;
    }
  }

 private:
  std::vector<double> from_, to_;
  double T_;
};

class Sines final : public TrajectoryFor<Sines> {
 public:
  Sines(std::vector<double> c, std::vector<double> a, std::vector<double> f)
      : c_(std::move(c)), a_(std::move(a)), f_(std::move(f)) {
    require_size("amplitude", a_.size(), c_.size());
    require_size("frequency", f_.size(), c_.size());
  }
  size_t size() const override { return c_.size(); }
  template <class T>
  void motion(T t, std::span<T> q, std::span<T> v, std::span<T> a) const {
    for (size_t i = 0; i < c_.size(); ++i) {
      const double w = 2 * std::acos(-1.0) * f_[i];
      const T s = phs::sin(T(w) * t), c = phs::cos(T(w) * t);
      q[i] = T(c_[i]) + T(a_[i]) * s;
      v[i] = T(a_[i] * w) * c;
      a[i] = T(-a_[i] * w * w) * s;
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

template <class T>
class PdPlus::Evaluator {
  using In = std::span<const T>;

 public:
  explicit Evaluator(std::shared_ptr<const Parts> parts)
      : p_(std::move(parts)), m_(p_->plant->mechanism()), w_(m_), n_(size_t(m_.nv())) {
    for (auto* v : {&q_, &v_, &a_, &e_, &de_, &sum_, &both_, &first_, &second_})
      v->resize(n_, T(0.0));
  }

  void operator()(T t, In x, std::span<T> u) {
    compare(t, x);
    // b(v) = C(q, v) v + ∂V/∂q is quadratic in v; C(q, q') q_d' is its polar form, with
    // Christoffel's symbols.
    const In q = x.first(n_);
    for (size_t i = 0; i < n_; ++i) sum_[i] = T(0.5) * (rate_[i] + v_[i]);
    mechanics::rnea<T>(m_, w_, q, sum_, a_, {}, both_);
    for (size_t i = 0; i < n_; ++i) sum_[i] = T(0.5) * (rate_[i] - v_[i]);
    mechanics::rnea<T>(m_, w_, q, sum_, {}, {}, first_);
    mechanics::rnea<T>(m_, w_, q, {}, {}, {}, second_);
    for (T& y : u) y = T(0.0);
    for (size_t i = 0; i < n_; ++i)  // M a + C v_d + ∂V: the two polar terms, gravity put back
      u[i] = both_[i] - first_[i] + second_[i] - T(p_->kp[i]) * e_[i] - T(p_->kd[i]) * de_[i];
    for (const auto& j : m_.joint_properties()) {
      T& y = u[size_t(j.v)];
      y = y + T(j.stiffness) * (x[size_t(j.q)] - T(j.rest)) + T(j.damping) * rate_[size_t(j.v)];
    }
  }
  T energy(T t, In x) {
    compare(t, x);
    mechanics::momenta_from_rates<T>(m_, w_, x.first(n_), de_, first_);
    T H(0.0);
    for (size_t i = 0; i < n_; ++i)
      H = H + T(0.5) * de_[i] * first_[i] + T(0.5 * p_->kp[i]) * e_[i] * e_[i];
    return H;
  }
  T power(T t, In x) {
    compare(t, x);
    T P(0.0);
    for (size_t i = 0; i < n_; ++i) P = P + T(p_->kd[i]) * de_[i] * de_[i];
    return P;
  }
  T error(T t, In x) {
    compare(t, x);
    T worst(0.0);
    for (const T& e : e_) worst = phs::max(worst, phs::abs(e));
    return worst;
  }

 private:
  void compare(T t, In x) {
    p_->trajectory->at(t, std::span<T>(q_), std::span<T>(v_), std::span<T>(a_));
    mechanics::rates_from_momenta<T>(m_, w_, x.first(n_), x.subspan(n_));
    rate_ = w_.rate;
    for (size_t i = 0; i < n_; ++i) {
      e_[i] = x[i] - q_[i];
      de_[i] = rate_[i] - v_[i];
    }
  }

  std::shared_ptr<const Parts> p_;
  const mechanics::Mechanism& m_;
  mechanics::Workspace<T> w_;
  size_t n_;
  std::vector<T> q_, v_, a_, rate_, e_, de_, sum_, both_, first_, second_;
};

PdPlus::PdPlus(std::shared_ptr<const mechanics::MechanicalModel> plant,
               std::shared_ptr<const Trajectory> trajectory, std::vector<double> kp,
               std::vector<double> kd)
    : parts_(std::make_shared<Parts>(
          Parts{std::move(plant), std::move(trajectory), std::move(kp), std::move(kd)})) {
  const auto& [model, path, p, d] = *parts_;
  const auto& m = model->mechanism();
  for (const auto& c : m.coordinates())
    if (c.nq != 1)
      throw InvalidArgument("PD+ takes joints of one degree of freedom; '" + c.joint + "' has " +
                            std::to_string(c.nv));
  require_size("trajectory", path->size(), size_t(m.nv()));
  require_size("kp", p.size(), size_t(m.nv()));
  require_size("kd", d.size(), size_t(m.nv()));
  for (size_t i = 0; i < p.size(); ++i)
    if (!(p[i] > 0) || !(d[i] > 0))
      throw InvalidArgument("PD+ needs kp > 0 and kd > 0; joint " + std::to_string(i) + " has " +
                            std::to_string(p[i]) + " and " + std::to_string(d[i]));
  evaluator_ = std::make_unique<Evaluator<double>>(parts_);
}
PdPlus::~PdPlus() = default;

void PdPlus::law(double t, std::span<const double> x, std::span<double> u) {
  (*evaluator_)(t, x, u);
}
double PdPlus::error_energy(double t, std::span<const double> x) {
  return evaluator_->energy(t, x);
}
double PdPlus::error_power(double t, std::span<const double> x) { return evaluator_->power(t, x); }
double PdPlus::error(double t, std::span<const double> x) { return evaluator_->error(t, x); }

namespace {
struct Source {
  std::shared_ptr<const PdPlus::Parts> parts;
  template <class T>
  auto evaluator() const {
    return PdPlus::Evaluator<T>(parts);
  }
};
}  // namespace

std::vector<PortLaw> PdPlus::port_laws() const {
  std::vector<int> all(parts_->kp.size());
  std::iota(all.begin(), all.end(), 0);
  return energy_shaping::port_laws(Source{parts_}, parts_->plant->description(), all);
}

}  // namespace porthos::energy_shaping
