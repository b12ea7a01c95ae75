#include "integrators/methods/tao.h"

#include <algorithm>

#include "integrators/core/entry.h"
#include "integrators/core/stagnation.h"

namespace porthos::integrators {

template <class T>
TaoMap<T>::TaoMap(const phs::Model& model, const CompositionTable* composition, double omega)
    : omega_(omega),
      m_(size_t(model.description().nx) / 2, T(1.0)),
      x_(2 * m_.size()),
      f_(2 * m_.size()) {
  using Real = TableReal<T>;
  if (composition)
    for (const Real g : composition->gammas<Real>()) gamma_.push_back(g);
  else
    gamma_.push_back(1);
  weigh(model);
}

template <class T>
void TaoMap<T>::weigh(const phs::Model& model) {
  const auto system = model.instantiate<T>();
  const auto& d = model.description();
  const size_t n = m_.size();
  for (const auto& b : d.blocks)
    if (b.kind == phs::BlockKind::rotation) x_[size_t(b.at)] = T(1.0);
  for (const auto& b : d.blocks) {
    if (b.at < 0 || size_t(b.at + b.size) > n) continue;
    // H does not change along the quaternion itself, so three directions represent the block.
    const int first = b.kind == phs::BlockKind::rotation ? 1 : 0;
    T inverse(0.0);
    system->field(T(0.0), x_, {}, f_);
    for (int k = first; k < b.size; ++k) inverse -= f_[size_t(b.at + k)];
    for (int k = first; k < b.size; ++k) {
      x_[n + size_t(b.at + k)] = T(1.0);
      system->field(T(0.0), x_, {}, f_);
      x_[n + size_t(b.at + k)] = T(0.0);
      inverse += f_[size_t(b.at + k)];
    }
    const T m = T(double(b.size - first)) / inverse;
    if (!(m > T(0.0)) || !(magnitude(m) < HUGE_VAL)) continue;
    for (int k = 0; k < b.size; ++k) m_[size_t(b.at + k)] = m;
  }
}

template <class T>
std::int64_t TaoMap<T>::evaluations_a_step() const {
  return 3 * std::int64_t(gamma_.size()) + 1;
}

/// φA (sign = 1): H(q, y) moves p and x. φB (sign = -1): H(x, p) moves q and y.
template <class T>
void TaoMap<T>::flow_of_half(phs::System<T>& system, T sign, T t, T dt, std::span<T> z,
                             std::span<T> lo, std::span<T> d) {
  const size_t n = m_.size();
  const T half = T(0.5) * sign;
  for (size_t i = 0; i < n; ++i) {
    x_[i] = z[i] + (lo[i] - half * d[i]);
    x_[n + i] = z[n + i] + (lo[n + i] + half * d[n + i]);
  }
  system.field(t, x_, {}, f_);
  for (size_t i = 0; i < 2 * n; ++i) {
    phs::compensated_add(z[i], lo[i], T(0.5) * dt * f_[i]);
    d[i] += (i < n ? sign : -sign) * dt * f_[i];
  }
}

/// φC: rotates (d_q, d_p/m) by 2ωt and leaves z unchanged.
template <class T>
void TaoMap<T>::bind(T dt, std::span<T> d) const {
  const size_t n = m_.size();
  T s, c;
  phs::sincos(T(2.0 * omega_) * dt, s, c);
  for (size_t i = 0; i < n; ++i) {
    const T dq = d[i], dp = d[n + i];
    d[i] = c * dq + s * dp / m_[i];
    d[n + i] = c * dp - s * m_[i] * dq;
  }
}

template <class T>
void TaoMap<T>::advance(phs::System<T>& system, T t, T h, std::span<T> z, std::span<T> lo,
                        std::span<T> d) {
  const auto part_of_h = [&](size_t i) {
    if constexpr (std::is_same_v<T, phs::Quad>)
      return gamma_[i] * h;
    else
      return T(double(gamma_[i])) * h;
  };
  // Time moves with φC. The last φA of a sub-step and the first of the next are merged.
  flow_of_half(system, T(1.0), t, T(0.5) * part_of_h(0), z, lo, d);
  for (size_t i = 0; i < gamma_.size(); ++i) {
    const T step = part_of_h(i), next = i + 1 < gamma_.size() ? part_of_h(i + 1) : T(0.0);
    flow_of_half(system, T(-1.0), t, T(0.5) * step, z, lo, d);
    bind(step, d);
    t += step;
    flow_of_half(system, T(-1.0), t, T(0.5) * step, z, lo, d);
    flow_of_half(system, T(1.0), t, T(0.5) * (step + next), z, lo, d);
  }
}

namespace {

template <class T>
class Tao final : public BasicIntegrator<T> {
  using Base = BasicIntegrator<T>;
  using Base::cost_, Base::n_, Base::system_;

 public:
  Tao(const Declaration& d, const CompositionTable* composition, const phs::Model& model, T h,
      const Options& o)
      : Base(d, model, h, o),
        map_(model, composition, o.binding > 0 ? o.binding : 20),
        d_(n_, T(0.0)),
        x_(n_),
        lo_(n_),
        d_before_(n_) {}

  Outcome advance(T t, T h, typename Base::State& s) override {
    std::copy(s.x.begin(), s.x.end(), x_.begin());
    std::copy(s.lo.begin(), s.lo.end(), lo_.begin());
    d_before_ = d_;
    map_.advance(*system_, t, h, s.x, s.lo, d_);
    cost_.evaluations += map_.evaluations_a_step();
    bool finite = true;
    for (size_t i = 0; i < n_; ++i)
      finite = finite && magnitude(s.x[i]) < HUGE_VAL && magnitude(d_[i]) < HUGE_VAL;
    if (finite) return Outcome::ok;
    std::copy(x_.begin(), x_.end(), s.x.begin());
    std::copy(lo_.begin(), lo_.end(), s.lo.begin());
    d_ = d_before_;
    return Outcome::not_finite;
  }

  void carry(Archive& a) override { a(d_); }

 private:
  TaoMap<T> map_;
  std::vector<T> d_;  ///< copy - original
  std::vector<T> x_, lo_, d_before_;
};

}  // namespace

template <class T>
std::unique_ptr<BasicIntegrator<T>> make_tao(const Declaration& d, const CompositionTable* c,
                                             const phs::Model& m, T h, const Options& o) {
  return std::make_unique<Tao<T>>(d, c, m, h, o);
}
#define PORTHOS_INSTANTIATE(T)                              \
  template class TaoMap<T>;                                 \
  template std::unique_ptr<BasicIntegrator<T>> make_tao<T>( \
      const Declaration&, const CompositionTable*, const phs::Model&, T, const Options&);
PORTHOS_FOR_EACH_STEP_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

Entries tao_entries() {
  const auto tao = [](std::string name, std::string title, int order,
                      const CompositionTable* composition) {
    // Properties in the doubled phase space do not carry over to the original one.
    return entry({.name = std::move(name),
                  .title = std::move(title),
                  .family = "Explicit, doubled phase space",
                  .order = order,
                  .needs = {.canonical = true, .lossless = true},
                  .source = "Tao 2016, Phys. Rev. E 94, 043303"},
                 [composition](const Declaration& d, const phs::Model& m, auto h,
                               const Options& o) { return make_tao(d, composition, m, h, o); });
  };
  return {tao("tao2", "Tao's explicit method in the doubled phase space", 2, nullptr),
          tao("tao4", "the triple jump of Tao's method", 4, &composition_table("yoshida4"))};
}

}  // namespace porthos::integrators
