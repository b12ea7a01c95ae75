#include <algorithm>
#include <numeric>

#include "phs/network/detail/network_linearised.h"
#include "phs/scalars/derivative.h"

namespace porthos::phs {
namespace {

using Plan = Network::Plan;

/// f''(x) by a second difference in 113 bits, exact in double: its own error and that of rounding
/// are both some 1e-17 of f.
double curvature(const Function& f, double x) {
  const Quad at(x), by = Quad(0x1p-27) * (Quad(1.0) + abs(at));
  return double((f(at + by) - Quad(2.0) * f(at) + f(at - by)) / (by * by));
}

/// A force of one number with its derivative, lane by lane.
template <class T>
struct ForceWithSlope {
  T force{0.0}, slope{0.0};

  void evaluate(const Function& f, const T& x) {
    for (int lane = 0; lane < lanes<T>; ++lane) {
      const Dual y = f(Dual(lane_of(x, lane), 1.0));
      set_lane(force, lane, y.v);
      set_lane(slope, lane, y.d);
    }
  }
};
template <class T>
struct ForceWithSlope<BasicDual<T>> {
  BasicDual<T> force{0.0}, slope{0.0};

  void evaluate(const Function& f, const BasicDual<T>& x) {
    ForceWithSlope<T> first;
    first.evaluate(f, x.v);
    T second(0.0);
    for (int lane = 0; lane < lanes<T>; ++lane)
      set_lane(second, lane, curvature(f, lane_of(x.v, lane)));
    force = {first.force, first.slope * x.d};
    slope = {first.slope, second * x.d};
  }
};

/// A source's value; its own time has no second part.
template <class T>
T value_at(const Function& f, const T& t) {
  return f(t);
}
template <class T>
requires is_pack<T> BasicDual<T> value_at(const Function& f, const BasicDual<T>& t) {
  return f(t.v);
}

template <class T>
std::unique_ptr<Linearised<T>> linearised_member(const Model& m) {
  if constexpr (std::is_same_v<T, WideDual>)
    return linearise_in_duals(m);
  else
    return linearise<T>(m);
}

template <class T>
class NetworkLinearised final : public Linearised<T> {
  using typename Linearised<T>::In;
  using typename Linearised<T>::Out;
  using typename Linearised<T>::Plain;

 public:
  NetworkLinearised(const Plan& plan, std::vector<HeldPtr> memories)
      : p_(plan),
        memories_(std::move(memories)),
        plain_(size_t(plan.nu())),
        lambda_(size_t(plan.nx())),
        mu_(lambda_.size()),
        turns_(size_t(plan.description.angle_count()), T(0.0)),
        springs_(plan.springs.size()),
        laws_(plan.laws.size()),
        sources_(plan.sources.size()) {
    for (const Plan::Member& m : p_.members) {
      members_.push_back(linearised_member<T>(*m.model));
      for (int i = 0; i < m.nu; ++i) {
        const Plain own = members_.back()->input(i);
        if (own.momentum >= 0) plain_[size_t(m.u + i)] = {own.rate + m.x, own.momentum + m.x};
      }
      const std::string prefix = p_.members.size() == 1 || m.main ? "" : m.name + ".";
      for (const auto& name : members_.back()->parameters()) names_.push_back(prefix + name);
    }
    own_ = names_.size();
    factors_.assign(p_.springs.size() + p_.laws.size() + p_.sources.size(), T(1.0));
    const auto element = [&](const auto& e) { names_.push_back(e.name + ".factor"); };
    std::ranges::for_each(p_.springs, element);
    std::ranges::for_each(p_.laws, element);
    std::ranges::for_each(p_.sources, element);
    const auto add_hold = [&](const std::string& name, std::vector<int> rows,
                              const std::vector<int>& sensors) {
      for (size_t k = 0; k < rows.size(); ++k) {
        held_.push_back({seen_.size(), k, rows[k]});
        names_.push_back(name + ".held[" + std::to_string(k) + "]");
      }
      rows.insert(rows.end(), sensors.begin(), sensors.end());
      seen_.push_back(std::move(rows));
    };
    for (const auto& c : p_.controls) {
      std::vector<int> rows(size_t(c.size));
      std::iota(rows.begin(), rows.end(), c.row);
      if (c.hold) add_hold(c.name, std::move(rows), c.sensors);
    }
    for (const auto& c : p_.sampled) add_hold(c.name, c.rows, {});
  }
  /// Whether this class covers everything that is joined.
  bool whole() const {
    const auto plain = [&](int row) { return plain_[size_t(row)].momentum >= 0; };
    const auto acts_plainly = [&](const auto& element) { return plain(element.row); };
    const auto held = [](const auto& c) { return c.hold && c.tank < 0; };
    return std::ranges::all_of(p_.controls, held) && std::ranges::all_of(p_.sampled, held) &&
           std::ranges::all_of(
               seen_, [&](const auto& rows) { return std::ranges::all_of(rows, plain); }) &&
           p_.filling.empty() && p_.bristles.empty() && p_.block_springs.empty() && p_.F.empty() &&
           std::ranges::all_of(p_.B, [&](const auto& b) { return plain(b.row) && plain(b.col); }) &&
           std::ranges::all_of(p_.laws, acts_plainly) &&
           std::ranges::all_of(p_.sources, acts_plainly);
  }

  void at(const T& t, In x, Out dx) override {
    for (size_t i = 0; i < members_.size(); ++i) members_[i]->at(t, state(i, x), state(i, dx));
    each(p_.springs, [&](const auto& s, size_t k) {
      const T turned = s.turn >= 0 ? turns_[size_t(s.turn)] : T(0.0);
      springs_[k].evaluate(*s.U.slope, x[size_t(s.q)] + turned);
      at_momentum(dx, s) = at_momentum(dx, s) - of_spring(k) * springs_[k].force;
    });
    each(p_.laws, [&](const auto& l, size_t k) {
      laws_[k].evaluate(*l.law, rate(dx, l.row));
      momentum(dx, l.row) = momentum(dx, l.row) - of_law(k) * laws_[k].force;
    });
    each(p_.sources, [&](const auto& s, size_t k) {
      sources_[k] = value_at(*s.v, t);
      momentum(dx, s.row) = momentum(dx, s.row) + of_source(k) * sources_[k];
    });
    for (const HeldValue& h : held_)
      momentum(dx, h.row) = momentum(dx, h.row) + T((*memories_[h.hold])[h.at]);
    couple(dx);
  }
  void times(In v, Out out) override {
    for (size_t i = 0; i < members_.size(); ++i) members_[i]->times(state(i, v), state(i, out));
    each(p_.springs, [&](const auto& s, size_t k) {
      at_momentum(out, s) = at_momentum(out, s) - of_spring(k) * springs_[k].slope * v[size_t(s.q)];
    });
    each(p_.laws, [&](const auto& l, size_t k) {
      momentum(out, l.row) = momentum(out, l.row) - of_law(k) * laws_[k].slope * rate(out, l.row);
    });
    couple(out);
  }
  void transpose_times(In lambda, Out out) override {
    std::copy(lambda.begin(), lambda.end(), lambda_.begin());
    std::copy(lambda.begin(), lambda.end(), mu_.begin());
    each(p_.laws, [&](const auto& l, size_t k) {
      rate(mu_, l.row) = rate(mu_, l.row) - of_law(k) * laws_[k].slope * momentum(lambda_, l.row);
    });
    for (const auto& b : p_.B)
      rate(mu_, b.col) = rate(mu_, b.col) + T(b.factor) * momentum(lambda_, b.row);
    for (size_t i = 0; i < members_.size(); ++i)
      members_[i]->transpose_times(state(i, In(mu_)), state(i, out));
    each(p_.springs, [&](const auto& s, size_t k) {
      T& to = out[size_t(s.q)];
      to = to - of_spring(k) * springs_[k].slope * at_momentum(lambda_, s);
    });
  }

  const std::vector<std::string>& parameters() const override { return names_; }
  void add_gradient(const T& weight, Out gradient) override {
    size_t at = 0;
    for (const auto& member : members_) {
      const size_t count = member->parameters().size();
      member->add_gradient(weight, gradient.subspan(at, count));
      at += count;
    }
    T* next = gradient.data() + own_;
    const auto add = [&](const T& lambda, const T& force) {
      *next = *next + weight * lambda * force;
      ++next;
    };
    each(p_.springs,
         [&](const auto& s, size_t k) { add(at_momentum(lambda_, s), -springs_[k].force); });
    each(p_.laws, [&](const auto& l, size_t k) { add(momentum(lambda_, l.row), -laws_[k].force); });
    each(p_.sources, [&](const auto& s, size_t k) { add(momentum(lambda_, s.row), sources_[k]); });
    for (const HeldValue& h : held_) add(momentum(lambda_, h.row), T(1.0));
  }
  size_t held() const override { return held_.size(); }
  void add_held(std::span<const double> change, Out out) override {
    each(held_, [&](const HeldValue& h, size_t k) {
      momentum(out, h.row) = momentum(out, h.row) + T(change[k]);
    });
  }
  /// y_i is number `rate` of the field, which no element is in.
  void add_flow_gradient(size_t hold, std::span<const double> weights, Out gradient) override {
    std::ranges::fill(mu_, T(0.0));
    for (size_t k = 0; k < weights.size(); ++k) {
      T& at = rate(mu_, seen_[hold][k]);
      at = at + T(weights[k]);
    }
    size_t at = 0;
    for (size_t i = 0; i < members_.size(); ++i) {
      const size_t count = members_[i]->parameters().size();
      members_[i]->transpose_times(state(i, In(mu_)), state(i, Out(lambda_)));
      members_[i]->add_gradient(T(1.0), gradient.subspan(at, count));
      at += count;
    }
  }

  void along_parameters(std::span<const double> change) override {
    size_t at = 0;
    for (const auto& member : members_) {
      const size_t count = member->parameters().size();
      member->along_parameters(change.subspan(at, count));
      at += count;
    }
    if constexpr (std::is_same_v<T, WideDual>)
      for (size_t k = 0; k < factors_.size(); ++k) factors_[k].d = decltype(T::d)(change[own_ + k]);
  }

  Plain input(int i) const override { return plain_[size_t(p_.open[size_t(i)])]; }
  void set_turn_angles(In angles) override {
    std::copy(angles.begin(), angles.end(), turns_.begin());
    for (size_t i = 0; i < members_.size(); ++i)
      members_[i]->set_turn_angles(
          angles.subspan(size_t(p_.members[i].angle), size_t(p_.members[i].angles)));
  }

 private:
  /// A value that a controller holds: the number of its hold, the place in its memory, its input.
  struct HeldValue {
    size_t hold, at;
    int row;
  };
  template <class Span>
  auto state(size_t i, Span x) const {
    return x.subspan(size_t(p_.members[i].x), size_t(p_.members[i].nx));
  }
  /// The entry of a vector like x' that an input adds to, and the one that is its output.
  template <class Vector>
  auto& momentum(Vector& x, int row) const {
    return x[size_t(plain_[size_t(row)].momentum)];
  }
  template <class Vector>
  auto& rate(Vector& x, int row) const {
    return x[size_t(plain_[size_t(row)].rate)];
  }
  template <class Vector>
  static auto& at_momentum(Vector& x, const Plan::Spring& s) {
    return x[size_t(s.p)];
  }
  /// Factors of elements, 1 but for their change.
  const T& of_spring(size_t k) const { return factors_[k]; }
  const T& of_law(size_t k) const { return factors_[p_.springs.size() + k]; }
  const T& of_source(size_t k) const { return factors_[p_.springs.size() + p_.laws.size() + k]; }
  template <class Elements, class Visit>
  static void each(const Elements& elements, const Visit& visit) {
    for (size_t k = 0; k < elements.size(); ++k) visit(elements[k], k);
  }
  /// dx += B y; rates are no momenta, so the order does not matter.
  void couple(Out dx) const {
    for (const auto& b : p_.B)
      momentum(dx, b.row) = momentum(dx, b.row) + T(b.factor) * rate(dx, b.col);
  }

  const Plan& p_;
  std::vector<HeldPtr> memories_;
  std::vector<HeldValue> held_;
  std::vector<std::vector<int>> seen_;  ///< by hold, the inputs whose outputs its law sees
  std::vector<std::unique_ptr<Linearised<T>>> members_;
  std::vector<Plain> plain_;  ///< by input
  std::vector<T> lambda_, mu_, turns_, factors_;
  std::vector<ForceWithSlope<T>> springs_, laws_;
  std::vector<T> sources_;
  std::vector<std::string> names_;
  size_t own_ = 0;  ///< parameters of the members
};

}  // namespace

template <class T>
std::unique_ptr<Linearised<T>> make_network_linearised(const Network::Plan& plan,
                                                       std::vector<HeldPtr> memories) {
  auto made = std::make_unique<NetworkLinearised<T>>(plan, std::move(memories));
  if (!made->whole()) return nullptr;
  return made;
}
#define PORTHOS_INSTANTIATE(T)                                                             \
  template std::unique_ptr<Linearised<T>> make_network_linearised<T>(const Network::Plan&, \
                                                                     std::vector<HeldPtr>);
PORTHOS_INSTANTIATE(double)
PORTHOS_INSTANTIATE(Pack4)
PORTHOS_INSTANTIATE(Pack8)
PORTHOS_INSTANTIATE(WideDual)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::phs
