#include "energy_shaping/elastic/detail/link_motion.h"

#include "mechanics/crba.h"
#include "mechanics/momentum.h"
#include "mechanics/rnea-inl.h"
#include "phs/linear_algebra/dense.h"

namespace porthos::energy_shaping {

template <class T>
LinkMotion<T>::LinkMotion(const mechanics::Mechanism& m, std::vector<double> K)
    : m_(m),
      K_(std::move(K)),
      w_(m),
      wd_(m),
      n_(size_t(m.nv())),
      M_(n_ * n_),
      L_(n_ * n_),
      tau_(n_),
      q_(n_),
      v_(n_),
      a_(n_),
      out_(n_) {
  for (auto* x : {&v, &a, &jerk, &load, &load_rate, &load_second}) x->resize(n_);
}

template <class T>
void LinkMotion<T>::solve_mass(std::vector<T>& force) const {
  phs::dense::solve(n_, L_.data(), force.data(), force.data());
}

template <class T>
void LinkMotion<T>::at(In q, In p, In theta, In theta_rate) {
  mechanics::rates_from_momenta<T>(m_, w_, q, p);
  v = w_.rate;
  mechanics::crba<T>(m_, w_, q, std::span<T>(M_));
  phs::dense::cholesky(n_, M_.data(), L_.data());

  mechanics::rnea<T>(m_, w_, q, v, {}, {}, std::span<T>(tau_));  // b + ∂V
  for (size_t i = 0; i < n_; ++i) a[i] = T(K_[i]) * (theta[i] - q[i]) - tau_[i];
  for (const auto& j : m_.joint_properties()) {
    const auto k = size_t(j.v);
    a[k] = a[k] - T(j.damping) * v[k] - T(j.stiffness) * (q[k] - T(j.rest));
  }
  solve_mass(a);

  for (size_t i = 0; i < n_; ++i) {  // along the motion, a kept
    q_[i] = DD(D(q[i], v[i]));
    v_[i] = DD(D(v[i], a[i]));
    a_[i] = DD(D(a[i]));
  }
  mechanics::rnea<DD>(m_, wd_, q_, v_, a_, {}, std::span<DD>(out_));
  for (size_t i = 0; i < n_; ++i) jerk[i] = T(K_[i]) * (theta_rate[i] - v[i]) - out_[i].v.d;
  for (const auto& j : m_.joint_properties()) {
    const auto k = size_t(j.v);
    jerk[k] = jerk[k] - T(j.damping) * a[k] - T(j.stiffness) * v[k];
  }
  solve_mass(jerk);

  for (size_t i = 0; i < n_; ++i) q_[i] = DD(D(q[i], v[i]), D(v[i], a[i]));  // to second order
  mechanics::rnea<DD>(m_, wd_, q_, {}, {}, {}, std::span<DD>(out_));         // ∂V
  for (size_t i = 0; i < n_; ++i) {
    load[i] = out_[i].v.v;
    load_rate[i] = out_[i].v.d;
    load_second[i] = out_[i].d.d;
  }
  for (const auto& j : m_.joint_properties()) {
    const auto k = size_t(j.v);
    load[k] = load[k] + T(j.stiffness) * (q[k] - T(j.rest));
    load_rate[k] = load_rate[k] + T(j.stiffness) * v[k];
    load_second[k] = load_second[k] + T(j.stiffness) * a[k];
  }
}

#define PORTHOS_INSTANTIATE(T) template class LinkMotion<T>;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::energy_shaping
