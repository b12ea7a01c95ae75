// The system of a mechanism with contacts and stops: their forces, losses and rows in the ledger.
#include <algorithm>

#include "contact/detail/point_forces.h"
#include "phs/system/forwarding.h"

namespace porthos::contact {
namespace {

using mechanics::Mechanism;
namespace passes = mechanics::passes;

template <class T>
class ContactSystem final : public phs::Forwarding<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;
  using Base = phs::Forwarding<T>;

 public:
  ContactSystem(const ContactModel& model, const ContactModel::Placed& placed)
      : Base(model.inner().template instantiate<T>(), model.description()),
        model_(model),
        placed_(placed),
        m_(model.mechanism()),
        gaps_(m_, placed),
        nq_(size_t(m_.nq())),
        rates_(size_t(m_.nv())),
        e_(2 * nq_, T(0.0)),
        Gu_(2 * nq_, T(0.0)),
        own_(2 * nq_),
        coefficients_(2 * placed.points + 2 * placed.stops.size()) {
    soft_ = !model.contacts().empty() || !model.stops().empty();
    for (const auto& c : model.contacts()) {
      lossy_ = lossy_ || c.law.loss > 0 || c.law.friction > 0;
      never_off_ = never_off_ || !c.law.switches();
    }
    for (const auto& s : model.stops()) {
      lossy_ = lossy_ || s.law.loss > 0;
      never_off_ = never_off_ || !s.law.switches();
    }
  }

  std::unique_ptr<phs::System<T>> clone() const override {
    return this->alike(std::make_unique<ContactSystem>(model_, placed_));
  }

  T hamiltonian(In x) override {
    T H = this->inner().hamiltonian(x);
    if (!soft_) return H;
    gaps_.place(x.first(nq_));
    each_point([&](size_t, const Law& law, const T& depth) { H = H + elastic_energy(law, depth); });
    return H;
  }
  void gradient(In x, Out e) override {
    this->inner().gradient(x, e);
    if (!soft_) return;
    gaps_.place(x.first(nq_));
    if (!touching()) return;
    gaps_.begin_forces();
    push_elastic();
    collect(x);
    for (size_t i = 0; i < nq_; ++i) e[i] = e[i] - Gu_[nq_ + i];
  }
  void field(T t, In x, In u, Out dx) override {
    this->inner().field(t, x, u, dx);
    rub(dx, dx, T(-1.0));
    if (!soft_) return;
    gaps_.place(x.first(nq_));
    if (!touching()) return;
    gaps_.begin_forces();
    push_elastic();
    if (lossy_) {
      std::copy_n(dx.begin(), nq_, e_.begin() + long(nq_));
      move(x, e_);
      resist();
      push_losses(T(1.0));
    }
    add_to(x, dx);
  }
  void rate(T t, In x, In e, Out dx) override {
    this->inner().rate(t, x, e, dx);
    rub(e.subspan(nq_), dx, T(-1.0));
    if (lose(x, e, e, T(1.0))) add_to(x, dx);
  }
  void efforts(T t, In x, In dx, Out e) override {
    In own = dx;
    if (!model_.dry().empty()) {
      std::copy(dx.begin(), dx.end(), own_.begin());
      rub(dx, own_, T(1.0));
      own = own_;
    }
    std::copy_n(dx.begin(), nq_, e_.begin() + long(nq_));
    if (lose(x, e_, e_, T(1.0))) {
      collect(x);
      for (size_t i = 0; i < 2 * nq_; ++i) own_[i] = own[i] - Gu_[i];
      own = own_;
    }
    this->inner().efforts(t, x, own, e);
  }
  void apply_dissipation(In x, In e, Out Re) override {
    this->inner().apply_dissipation(x, e, Re);
    if (!lossy_ && model_.dry().empty()) return;
    gradient(x, own_);  // a nonlinear law enters R(x) as its secant at the rates of x
    for (size_t k = 0; k < model_.dry().size(); ++k) {
      const size_t i = nq_ + model_.placed_dry()[k].q;
      const T v = own_[i], secant = friction_at(model_.dry()[k], v) / v;
      using phs::abs, phs::select;
      // A joint at rest may keep a rate of 1e-323, at which the secant overflows.
      Re[i] = Re[i] + select(abs(v) > T(1e-30), secant, T(0.0)) * e[i];
    }
    if (!lossy_) return;
    if (lose(x, own_, e, T(-1.0))) add_to(x, Re);
  }

  void stored(In x, Out values) override {
    Base::stored(x, values);
    if (!soft_) return;
    gaps_.place(x.first(nq_));
    each_point([&](size_t row, const Law& law, const T& depth) {
      T& value = values[this->inner_storages() + row];
      value = value + elastic_energy(law, depth);
    });
  }
  void powers(T t, In x, In e, Out values) override {
    Base::powers(t, x, e, values);
    add_rubbed(e, values);
    if (!lossy_) return;
    gaps_.place(x.first(nq_));
    if (!touching()) return;
    move(x, e);
    resist();
    size_t k = this->inner_powers();
    for (size_t c = 0; c < model_.contacts().size(); ++c) {
      const Law& law = model_.contacts()[c].law;
      T loss(0.0), rubbed(0.0);
      each_touch([&](const ContactModel::Pair& p, size_t pair, size_t i) {
        if (p.contact != c) return;
        const Slip<T> v = slip(gaps_, pair, i);
        loss = loss + coefficients_[2 * i] * v.depth_rate * v.depth_rate;
        rubbed = rubbed + coefficients_[2 * i + 1] * dot(v.along, v.along);
      });
      if (law.loss > 0) values[k++] = loss;
      if (law.friction > 0) values[k++] = rubbed;
    }
    for (size_t s = 0; s < placed_.stops.size(); ++s) {
      if (!(model_.stops()[s].law.loss > 0)) continue;
      const T& v = rates_[placed_.stops[s].v];
      values[k++] = (of_stop(s, 0) + of_stop(s, 1)) * v * v;
    }
  }
  void set_turn_angles(In angles) override {
    Base::set_turn_angles(angles);
    gaps_.set_turn_angles(angles);
  }
  /// A contact may be much stiffer than the mechanism: no solver of its own knows it.
  std::unique_ptr<phs::Resolvent> resolvent() override {
    return soft_ ? nullptr : Base::resolvent();
  }

 private:
  /// Calls f(pair, its index, point) for each point of all pairs.
  template <class F>
  void each_touch(F f) {
    for (size_t k = 0; k < placed_.pairs.size(); ++k) {
      const ContactModel::Pair& p = placed_.pairs[k];
      for (size_t i = p.first; i < p.first + p.points; ++i) f(p, k, i);
    }
  }
  /// Calls f(row in the ledger, law, depth) for each point and each limit of a stop.
  template <class F>
  void each_point(F f) {
    each_touch([&](const ContactModel::Pair& p, size_t, size_t i) {
      f(p.contact, model_.contacts()[p.contact].law, -gaps_.touch[i].gap);
    });
    for (size_t s = 0; s < placed_.stops.size(); ++s)
      for (size_t side = 0; side < 2; ++side)
        if (limited(s, side))
          f(model_.contacts().size() + s, model_.stops()[s].law, gaps_.depth[2 * s + side]);
  }
  bool limited(size_t stop, size_t side) const {
    const Stop& s = model_.stops()[stop];
    return std::isfinite(side == 0 ? s.lower : s.upper);
  }
  /// Whether anything pushes, in any lane.
  bool touching() {
    if (never_off_) return true;
    bool some = false;
    each_point(
        [&](size_t, const Law&, const T& depth) { some = some || phs::any(depth > T(0.0)); });
    return some;
  }

  // --- forces ------------------------------------------------------------------------------------
  void push_stop(size_t s, size_t side, const T& force) {
    T& f = gaps_.force[placed_.stops[s].v];
    f = side == 0 ? f + force : f - force;
  }
  void push_elastic() {
    each_touch([&](const ContactModel::Pair& p, size_t pair, size_t i) {
      const auto& touch = gaps_.touch[i];
      gaps_.push_apart(pair, i,
                       elastic_force(model_.contacts()[p.contact].law, T(-touch.gap)) * touch.n);
    });
    for (size_t s = 0; s < placed_.stops.size(); ++s)
      for (size_t side = 0; side < 2; ++side)
        if (limited(s, side))
          push_stop(s, side, elastic_force(model_.stops()[s].law, gaps_.depth[2 * s + side]));
  }
  /// Joint forces of all wrenches as p' in Gu_.
  void collect(In x) {
    gaps_.collect();
    passes::lift(m_, x.data(), gaps_.force.data(), Gu_.data() + nq_);
  }
  void add_to(In x, Out dx) {
    collect(x);
    for (size_t i = nq_; i < 2 * nq_; ++i) dx[i] = dx[i] + Gu_[i];
  }

  // --- dry friction: the rates of joints with one freedom are q' = ∂H/∂p -------------------------
  /// Adds to p' its force, times `sign`. @param rates  begins with q'
  void rub(In rates, Out dx, const T& sign) {
    for (size_t k = 0; k < model_.dry().size(); ++k) {
      const size_t q = model_.placed_dry()[k].q;
      dx[nq_ + q] = dx[nq_ + q] + sign * friction_at(model_.dry()[k], rates[q]);
    }
  }
  /// Its powers, the last rows of the model.
  void add_rubbed(In e, Out values) {
    const auto& dry = model_.dry();
    const size_t first = model_.description().powers.size() - 2 * dry.size();
    for (size_t k = 0; k < dry.size(); ++k) {
      const T& v = e[nq_ + model_.placed_dry()[k].q];
      values[first + 2 * k] = v * friction_at(dry[k], v);
    }
  }

  // --- losses ------------------------------------------------------------------------------------
  /// Joint rates of the efforts e, and the twists of all nodes.
  void move(In x, In e) {
    passes::transposed_lift(m_, x.data(), e.data() + nq_, rates_.data());
    if (!placed_.pairs.empty()) passes::twists(m_, gaps_.w, rates_.data());
  }
  const T& of_stop(size_t s, size_t side) const {
    return coefficients_[2 * placed_.points + 2 * s + side];
  }
  /// The coefficients of loss and friction at the motion of move().
  void resist() {
    each_touch([&](const ContactModel::Pair& p, size_t pair, size_t i) {
      const Law& law = model_.contacts()[p.contact].law;
      const Slip<T> v = slip(gaps_, pair, i);
      const auto c = resistance(law, elastic_force(law, T(-gaps_.touch[i].gap)), v);
      coefficients_[2 * i] = c.loss;
      coefficients_[2 * i + 1] = c.friction;
    });
    for (size_t s = 0; s < placed_.stops.size(); ++s)
      for (size_t side = 0; side < 2; ++side) {
        const Law& law = model_.stops()[s].law;
        const T v = rates_[placed_.stops[s].v];
        coefficients_[2 * placed_.points + 2 * s + side] =
            limited(s, side) ? loss_coefficient(law, elastic_force(law, gaps_.depth[2 * s + side]),
                                                side == 0 ? -v : v)
                             : T(0.0);
      }
  }
  /// Forces of the coefficients at the motion of move(), times `sign`.
  void push_losses(const T& sign) {
    each_touch([&](const ContactModel::Pair&, size_t pair, size_t i) {
      const Slip<T> v = slip(gaps_, pair, i);
      const Vec3<T> normal = (coefficients_[2 * i] * v.depth_rate) * gaps_.touch[i].n;
      gaps_.push_apart(pair, i, sign * (normal - coefficients_[2 * i + 1] * v.along));
    });
    for (size_t s = 0; s < placed_.stops.size(); ++s) {
      T& f = gaps_.force[placed_.stops[s].v];
      f = f - sign * (of_stop(s, 0) + of_stop(s, 1)) * rates_[placed_.stops[s].v];
    }
  }
  /// The losses of laws evaluated at the efforts `of`, for the motion of the efforts e. False if
  /// there are none.
  bool lose(In x, In of, In e, const T& sign) {
    if (!lossy_) return false;
    gaps_.place(x.first(nq_));
    if (!touching()) return false;
    gaps_.begin_forces();
    move(x, of);
    resist();
    if (e.data() != of.data()) move(x, e);
    push_losses(sign);
    return true;
  }

  const ContactModel& model_;
  const ContactModel::Placed& placed_;
  const Mechanism& m_;
  Gaps<T> gaps_;
  size_t nq_;
  std::vector<T> rates_;         ///< per freedom
  std::vector<T> e_, Gu_, own_;  ///< per number of the state
  std::vector<T> coefficients_;  ///< per point: of loss and friction; per limit: of loss
  bool soft_ = false, lossy_ = false, never_off_ = false;
};

}  // namespace

template <class T>
std::unique_ptr<phs::System<T>> ContactModel::make_system() const {
  return std::make_unique<ContactSystem<T>>(*this, placed_);
}

#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<phs::System<T>> ContactModel::make_system<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::contact
