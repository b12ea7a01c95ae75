#include "phs/network/detail/network_plan.h"

namespace porthos::phs {

NetworkModel::NetworkModel(std::shared_ptr<const Network::Plan> plan) : plan_(std::move(plan)) {}
const Description& NetworkModel::description() const { return plan_->description; }

std::vector<HoldPtr> NetworkModel::holds() const {
  std::vector<HoldPtr> list;
  for (const auto& c : plan_->controls)
    if (c.hold) list.push_back(c.hold);
  for (const auto& c : plan_->sampled) list.push_back(c.hold);
  return list;
}

int NetworkModel::offset(const std::string& member) const {
  for (const auto& m : plan_->members)
    if (m.name == member) return m.x;
  throw InvalidArgument("network '" + plan_->name + "' has no member '" + member + "'");
}
const Model& NetworkModel::member(const std::string& name) const {
  for (const auto& m : plan_->members)
    if (m.name == name) return *m.model;
  throw InvalidArgument("network '" + plan_->name + "' has no member '" + name + "'");
}
const std::vector<std::string>& NetworkModel::casimirs() const { return plan_->casimir_texts; }

}  // namespace porthos::phs
