// Tanks of a network: stores of energy that pay for controllers.
#include <algorithm>

#include "phs/network/detail/network_ports.h"
#include "phs/system/user_model.h"

namespace porthos::phs {
namespace {

/// H = E.
struct EnergyStore {
  std::string name;

  Description description() const {
    Description d;
    d.name = name;
    d.nx = 1;
    d.blocks = {{name, BlockKind::linear, 0, 1, -1, "J", ""}};
    d.storages = {name};
    return d;
  }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return x[0];
  }
  template <class T>
  void gradient(std::span<const T>, std::span<T> e) const {
    e[0] = T(1.0);
  }
  template <class T>
  void structure(std::span<const T>, std::span<const T>, std::span<T> Je) const {
    Je[0] = T(0.0);
  }
};

}  // namespace

int find_tank(const Network::Plan& p, const std::string& of, const std::string& name) {
  if (name.empty()) return -1;
  const auto at = std::ranges::find(p.tanks, name, &Network::Plan::Tank::name);
  if (at != p.tanks.end()) return int(at - p.tanks.begin());
  refuse(p, "'" + of + "' names the tank '" + name + "', expected one that was added before");
}

Network& Network::tank(const std::string& name, const Tank& bounds) {
  if (!(bounds.least >= 0 && bounds.least < bounds.most && std::isfinite(bounds.most)))
    refuse(*plan_, "the tank '" + name + "' holds " + number(bounds.least, 6) + " to " +
                       number(bounds.most, 6) + " J, expected 0 <= least < most");
  add(name, std::make_shared<UserModel<EnergyStore>>(EnergyStore{name}));
  auto& own = plan_->members.back();
  own.main = true;  // its block and its storage have the member's name already
  plan_->tanks.push_back({name, int(plan_->members.size()) - 1, own.x, bounds.least, bounds.most});
  return *this;
}

Network& Network::fill(const std::string& name, const std::vector<std::string>& names,
                       const std::vector<double>& d, double fill, const std::string& tank) {
  require_new_name(*plan_, name);
  std::vector<FoundPort> ports;
  for (const auto& n : names) ports.push_back(find_port(*plan_, n));
  const auto rows = rows_of(ports);
  require_size("damping", d.size(), rows.size());
  for (const double own : d)
    if (!(own >= 0) || !std::isfinite(own))
      refuse(*plan_, "the damping of '" + name + "' is " + number(own, 6) + ", expected 0 or more");
  if (!(fill >= 0 && fill <= 1))
    refuse(*plan_, "'" + name + "' fills its tank with the share " + number(fill, 6) +
                       ", expected one in [0, 1]");
  if (tank.empty()) refuse(*plan_, "'" + name + "' fills no tank, expected the name of one");
  plan_->filling.push_back({name, rows, d, fill, find_tank(*plan_, name, tank)});
  return *this;
}

}  // namespace porthos::phs
