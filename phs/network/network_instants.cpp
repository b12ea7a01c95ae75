// The sampling instants of a network in duals.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "phs/network/detail/network_plan.h"

namespace porthos::phs {
namespace {

class NetworkInstants final : public Instants {
  using Plan = Network::Plan;
  using In = std::span<const Dual>;
  using Out = std::span<Dual>;

 public:
  NetworkInstants(std::shared_ptr<const Plan> plan, std::unique_ptr<System<Dual>> whole)
      : plan_(std::move(plan)),
        p_(*plan_),
        whole_(std::move(whole)),
        turns_(size_t(p_.description.angle_count())),
        e_(size_t(p_.nx())),
        y_(size_t(p_.nu())) {
    for (const auto& m : p_.members) members_.push_back(m.model->instantiate<Dual>());
    for (const auto& c : p_.controls)
      if (c.hold) controls_.push_back(&c);
    for (const auto& c : p_.sampled)
      if (!dynamic_cast<const SmoothSampledLaw*>(c.law.get()))
        throw InvalidArgument("'" + p_.name + "': the law of the sampled controller '" + c.name +
                              "' has no derivatives, expected one without a memory, "
                              "or a phs::SmoothSampledLaw");
  }

  std::vector<LawGain> gains(size_t i) const override {
    std::vector<LawGain> all;
    std::string name;
    if (i < controls_.size()) {
      name = controls_[i]->name;
      if (const auto* law = dynamic_cast<const WithGains*>(controls_[i]->law.get()))
        all = law->gains();
    } else {
      name = with_memory(i).name;
      all = smooth(with_memory(i)).gains();
    }
    for (auto& gain : all) gain.name = name + "." + gain.name;
    return all;
  }
  void set_turn_angles(In angles) override {
    std::copy(angles.begin(), angles.end(), turns_.begin());
    whole_->set_turn_angles(angles);
    for (size_t i = 0; i < members_.size(); ++i)
      members_[i]->set_turn_angles(
          angles.subspan(size_t(p_.members[i].angle), size_t(p_.members[i].angles)));
  }
  size_t flows(size_t i) const override {
    if (i >= controls_.size()) return with_memory(i).rows.size();
    return size_t(controls_[i]->size) + controls_[i]->sensors.size();
  }
  void sample(size_t i, In gains, const Dual& t, In x, In changes, Out memory) override {
    whole_->gradient(x, e_);
    for (size_t k = 0; k < members_.size(); ++k) {
      const auto& m = p_.members[k];
      if (m.active)
        members_[k]->output(x.subspan(size_t(m.x), size_t(m.nx)),
                            In(e_).subspan(size_t(m.x), size_t(m.nx)),
                            Out(y_).subspan(size_t(m.u), size_t(m.nu)));
    }
    if (i < controls_.size())
      renew(*controls_[i], gains, t, x, changes, memory);
    else
      renew(with_memory(i), gains, t, x, changes, memory);
  }

 private:
  const Plan::SampledControl& with_memory(size_t i) const {
    return p_.sampled[i - controls_.size()];
  }
  static const SmoothSampledLaw& smooth(const Plan::SampledControl& c) {
    return static_cast<const SmoothSampledLaw&>(*c.law);
  }
  void unwrap(In x, size_t at, size_t count) {
    seen_.resize(count);
    for (size_t k = 0; k < count; ++k) seen_[k] = unwrapped(x, at + k);
  }
  Dual unwrapped(In x, size_t k) const {
    return p_.turn_of[k] < 0 ? x[k] : x[k] + turns_[size_t(p_.turn_of[k])];
  }
  void see(const std::vector<int>& rows, In changes) {
    for (const int row : rows) flows_.push_back(y_[size_t(row)] + changes[flows_.size()]);
  }
  void renew(const Plan::Control& c, In gains, const Dual& t, In x, In changes, Out memory) {
    const auto n = size_t(c.size);
    std::vector<int> own(n);
    std::iota(own.begin(), own.end(), c.row);
    flows_.clear();
    see(own, changes);
    see(c.sensors, changes);
    for (size_t k = 0; k < c.encoder.size(); ++k) {
      Dual& last = memory[n + k];
      const Dual now = unwrapped(x, size_t(c.encoder[k]));
      if (!std::isnan(last.v)) flows_[k] = (now - last) / Dual(c.hold->period);
      last = now;
    }
    const auto seen = p_.seen(c);
    unwrap(x, seen.first, seen.second);
    if (!open(c, t, memory))
      std::ranges::fill(memory.first(n), Dual(0.0));
    else if (const auto* law = dynamic_cast<const WithGains*>(c.law.get()))
      law->with_gains(gains, t, seen_, flows_, memory.first(n));
    else
      (*c.law)(t, In(seen_), In(flows_), memory.first(n));
  }
  /// What a gate remembers has no slope: it opens or it does not.
  bool open(const Plan::Control& c, const Dual& t, Out memory) {
    if (!c.gate) return true;
    const Out own = memory.subspan(c.gate_at());
    std::vector<double> x, remembered;
    for (const Dual& number : seen_) x.push_back(number.v);
    for (const Dual& number : own) remembered.push_back(number.v);
    c.gate->renew(t.v, x, remembered);
    std::copy(remembered.begin(), remembered.end(), own.begin());
    return c.gate->open(remembered);
  }
  void renew(const Plan::SampledControl& c, In gains, const Dual& t, In x, In changes, Out memory) {
    const auto& m = p_.members[size_t(c.member)];
    unwrap(x, size_t(m.x), size_t(m.nx));
    flows_.clear();
    see(c.rows, changes);
    const size_t n = flows_.size();
    smooth(c).in_duals(gains, t, seen_, flows_, memory.subspan(n), memory.first(n));
  }

  std::shared_ptr<const Plan> plan_;
  const Plan& p_;
  std::unique_ptr<System<Dual>> whole_;
  std::vector<std::unique_ptr<System<Dual>>> members_;
  std::vector<const Plan::Control*> controls_;  ///< those with a hold
  std::vector<Dual> turns_, e_, y_, seen_, flows_;
};

}  // namespace

std::unique_ptr<Instants> NetworkModel::instants() const {
  if (holds().empty()) return nullptr;
  return std::make_unique<NetworkInstants>(plan_, instantiate<Dual>());
}

}  // namespace porthos::phs
