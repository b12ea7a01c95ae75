#include "energy_shaping/loop/port_law.h"

#include <fmt/format.h>

namespace porthos::energy_shaping {
namespace {

struct LoopLaw {
  std::shared_ptr<const ClosedLoop> loop;
  std::vector<double> limits;

  template <class T>
  auto evaluator() const {
    return [s = loop->loop<T>(), keep = loop, bounds = limits](T t, std::span<const T> x,
                                                               std::span<T> u) mutable {
      s->law(t, x, u);
      for (size_t j = 0; j < bounds.size(); ++j) {
        T& v = u[size_t(keep->actuated()[j])];
        v = phs::max(phs::min(v, T(bounds[j])), T(-bounds[j]));
      }
    };
  }
};

/// A law as it is, which tells the limit that it keeps.
class LimitedLaw final : public phs::Law, public phs::WithLimit {
 public:
  LimitedLaw(phs::LawPtr law, double limit) : law_(std::move(law)), limit_(limit) {}
#define PORTHOS_EVALUATE(T)                                                               \
  void operator()(const T& t, std::span<const T> x, std::span<const T> y, std::span<T> u) \
      const override {                                                                    \
    (*law_)(t, x, y, u);                                                                  \
  }
  PORTHOS_FOR_EACH_SCALAR(PORTHOS_EVALUATE)
#undef PORTHOS_EVALUATE
  std::string hindrance(std::span<const double> x) const override { return law_->hindrance(x); }
  double limit() const override { return limit_; }

 private:
  phs::LawPtr law_;
  double limit_;
};

/// A law with gains, whose derivatives runs have, stays as it is.
phs::LawPtr telling_its_limit(const PortLaw& l) {
  if (!(l.limit < HUGE_VAL) || dynamic_cast<const phs::WithGains*>(l.law.get())) return l.law;
  return std::make_shared<LimitedLaw>(l.law, l.limit);
}

}  // namespace

PortLaw* law_of(std::vector<PortLaw>& laws, const phs::Description& plant, int input) {
  for (const auto& port : plant.ports)
    for (PortLaw& law : laws)
      if (port.size == 1 && port.at == input && law.port == port.name) return &law;
  return nullptr;
}

std::vector<PortLaw> port_laws(std::shared_ptr<const ClosedLoop> loop, std::vector<double> limits) {
  if (!limits.empty()) require_size("limits", limits.size(), loop->actuated().size());
  for (const double l : limits)
    if (!(l >= 0))
      throw InvalidArgument(fmt::format("the law of '{}' has a limit {}, expected one >= 0",
                                        loop->description().name, l));
  const auto& plant = loop->plant().description();
  const auto at = loop->actuated();
  auto laws = port_laws(LoopLaw{loop, limits}, plant, at,
                        [loop](std::span<const double> x) { return loop->hindrance(x); });
  for (size_t j = 0; j < limits.size(); ++j)
    if (PortLaw* law = law_of(laws, plant, at[j])) law->limit = limits[j];
  return laws;
}

phs::Network& control(phs::Network& network, const std::string& name, const std::string& member,
                      const std::vector<PortLaw>& laws, const phs::Network::Control& how) {
  if (laws.empty()) throw InvalidArgument("the controller '" + name + "' has no port");
  if (!how.encoder.empty() && laws.size() > 1)
    throw InvalidArgument("the controller '" + name + "' acts on " + std::to_string(laws.size()) +
                          " ports and has an encoder, which belongs to one: expected each port's "
                          "law in a Network::control of its own");
  for (const auto& l : laws)
    network.control(laws.size() == 1 ? name : name + "." + l.port, member + "." + l.port,
                    telling_its_limit(l), how);
  return network;
}

}  // namespace porthos::energy_shaping
