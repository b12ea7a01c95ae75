#include <algorithm>

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

namespace {

/// Calls f(gate, its memory) for each gate. Returns the memory behind that of their controllers.
template <class F>
std::span<const double> each_gate(const Network::Plan& plan, std::span<const double> memory, F f) {
  for (const auto& c : plan.controls) {
    if (!c.hold) continue;
    const size_t size = c.hold->fresh.size();
    if (memory.size() < size) require_size("memory of the controllers", memory.size(), size);
    if (c.gate) f(*c.gate, memory.first(size).subspan(c.gate_at()));
    memory = memory.subspan(size);
  }
  return memory;
}

}  // namespace

std::vector<std::string> NetworkModel::stories(std::span<const double> memory, double since) const {
  std::vector<std::string> list;
  memory = each_gate(*plan_, memory, [&](const Gate& gate, std::span<const double> own) {
    if (auto told = gate.story(own, since); !told.empty()) list.push_back(std::move(told));
  });
  for (const auto& c : plan_->sampled) {
    const size_t size = c.hold->fresh.size();
    if (memory.size() < size) require_size("memory of the controllers", memory.size(), size);
    for (auto& told : c.law->stories(memory.first(size).subspan(c.rows.size())))
      list.push_back(std::move(told));
    memory = memory.subspan(size);
  }
  return list;
}

std::string NetworkModel::hindrance(const State& state) const {
  const auto x = with_turns(plan_->description, state);
  for (const auto& c : plan_->controls) {
    const auto [at, size] = plan_->seen(c);
    if (const auto why = c.law->hindrance(std::span(x).subspan(at, size)); !why.empty())
      return "controller '" + c.name + "': " + why;
  }
  return {};
}

std::vector<NetworkModel::Limited> NetworkModel::limited() const {
  std::vector<Limited> list;
  for (const auto& c : plan_->controls)
    if (const auto* law = dynamic_cast<const WithLimit*>(c.law.get()); law && !c.gate) {
      const auto [at, size] = plan_->seen(c);
      list.push_back({c.name, c.law, law->limit(), at, size});
    }
  return list;
}

std::optional<int> NetworkModel::waiting(std::span<const double> memory) const {
  std::optional<int> count;
  each_gate(*plan_, memory, [&](const Gate& gate, std::span<const double> own) {
    count = count.value_or(0) + gate.waits(own);
  });
  return count;
}

bool NetworkModel::has(const std::string& member) const {
  return std::ranges::any_of(plan_->members, [&](const auto& m) { return m.name == member; });
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
const std::vector<Casimir>& NetworkModel::casimirs() const { return plan_->casimirs; }

}  // namespace porthos::phs
