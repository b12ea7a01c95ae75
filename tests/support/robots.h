#pragma once
#include <cmath>

#include "mechanics/mechanical_model.h"
#include "mechanics/urdf.h"
#include "phs/system/state.h"
#include "tests/places.h"
#include "tests/support/tree_case.h"

/// The robots of the long runs with their start values.
namespace porthos::test {

struct Robot {
  std::shared_ptr<const mechanics::MechanicalModel> model;
  phs::State start;
};

inline Robot make_robot(std::shared_ptr<const mechanics::Mechanism> m,
                        const std::vector<double>& angles, const std::vector<double>& rates) {
  auto model = std::make_shared<mechanics::MechanicalModel>(m);
  auto q = m->neutral();
  std::vector<double> v(size_t(m->nv()), 0.0);
  std::copy(angles.begin(), angles.end(), q.end() - long(angles.size()));
  std::copy(rates.begin(), rates.end(), v.end() - long(rates.size()));
  return {model, phs::State(model->description(), model->state(q, v))};
}

/// examples/ets_vii: 2552 kg base, six joints at up to 0.1 rad/s.
inline Robot ets_vii(double rate = 1) {
  mechanics::UrdfOptions o;
  o.base = mechanics::UrdfOptions::Base::free;
  o.accept_unphysical_inertia = true;
  const auto urdf = mechanics::read_urdf(PORTHOS_SOURCE_DIR "/examples/ets_vii/ets_vii.urdf", o);
  std::vector<double> v{0.05, -0.07, 0.1, 0.08, -0.06, 0.1};
  for (auto& x : v) x *= rate;
  return make_robot(std::make_shared<mechanics::Mechanism>(urdf.mechanism),
                    {0.3, -0.6, 1.1, -0.4, 0.9, 0.2}, v);
}

/// The fast chaotic case of the peers' table: a 7-joint arm on a 150 kg free base, rates about 1
/// rad/s at the start and tens of rad/s in the wrist later.
inline const char* const fast_case_file = "reference/pinocchio/urdf/sat_panda.urdf";
inline Robot fast_case() {
  mechanics::UrdfOptions o;
  o.base = mechanics::UrdfOptions::Base::free;
  o.links_without_inertia = mechanics::UrdfOptions::NoInertia::massless;
  const auto urdf = mechanics::read_urdf(test::data_file(fast_case_file).string(), o);
  return make_robot(std::make_shared<mechanics::Mechanism>(urdf.mechanism),
                    {0.3, -0.5, 0.4, -1.8, 0.2, 1.4, 0.1}, {0.9, -1.1, 0.8, 1.0, -0.7, 1.2, -0.9});
}

/// A state with its turns put back, in 113 bits.
inline std::vector<phs::Quad> unwrapped(const phs::Description& d, const phs::State& s) {
  std::vector<phs::Quad> x(s.x.begin(), s.x.end());
  size_t turn = 0;
  for (size_t i = 0; i < x.size(); ++i) x[i] += phs::Quad(s.lo[i]);
  for (const auto& b : d.blocks)
    if (b.kind == phs::BlockKind::angle)
      x[size_t(b.at)] += phs::Quad(double(s.turns[turn++])) *
                         (phs::Quad(phs::two_pi_hi) + phs::Quad(phs::two_pi_lo));
  return x;
}

/// Largest |a - b| / (1 + |b|).
inline double distance(const std::vector<phs::Quad>& a, const std::vector<phs::Quad>& b) {
  phs::Quad worst = 0;
  for (size_t i = 0; i < a.size(); ++i)
    worst = std::max(worst, phs::abs(a[i] - b[i]) / (1 + phs::abs(b[i])));
  return double(worst);
}

/// Measures energy and invariants from value + low word in extended precision.
class Gauge {
 public:
  explicit Gauge(const phs::Model& model)
      : d_(model.description()),
        system_(model.instantiate<long double>()),
        x_(size_t(d_.nx)),
        turns_(size_t(d_.angle_count())),
        values_(size_t(d_.invariant_count())) {}

  long double energy(const phs::State& s) {
    load(s);
    return system_->hamiltonian(x_);
  }
  const std::vector<long double>& invariants(const phs::State& s) {
    load(s);
    system_->invariants(x_, values_);
    return values_;
  }

  /// |I - I0| / |I0| of the invariant of that name.
  double error(const std::string& name, const phs::State& s,
               const std::vector<long double>& start) {
    const auto& now = invariants(s);
    for (const auto& i : d_.invariants) {
      if (i.name != name) continue;
      long double d = 0, n = 0;
      for (size_t k = size_t(i.at); k < size_t(i.at + i.size); ++k) {
        d += (now[k] - start[k]) * (now[k] - start[k]);
        n += start[k] * start[k];
      }
      return double(std::sqrt(d / n));
    }
    throw InvalidArgument("no invariant " + name);
  }

 private:
  void load(const phs::State& s) {
    for (size_t i = 0; i < x_.size(); ++i) x_[i] = (long double)s.x[i] + s.lo[i];
    for (size_t i = 0; i < turns_.size(); ++i)
      turns_[i] = 6.283185307179586476925286766559L * (long double)s.turns[i];
    system_->set_turn_angles(turns_);
  }
  const phs::Description& d_;
  std::unique_ptr<phs::System<long double>> system_;
  std::vector<long double> x_, turns_, values_;
};

}  // namespace porthos::test
