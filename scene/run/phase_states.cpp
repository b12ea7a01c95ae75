#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "phs/network/network.h"
#include "scene/assemble/parts.h"
#include "scene/files/hdf5_file.h"
#include "scene/run/phase_sequence.h"

/// What is kept from phase to phase besides the mechanism's state: what waits for an event, too.
namespace porthos::scene {

void OrbitApart::take_off(phs::State& s) {
  if (!in_orbit_) return;
  x_.assign(s.x.end() - 6, s.x.end());
  lo_.assign(s.lo.end() - 6, s.lo.end());
  s.x.resize(s.x.size() - 6);
  s.lo.resize(s.lo.size() - 6);
}

void OrbitApart::put_back(phs::State& s) const {
  if (!in_orbit_) return;
  s.x.insert(s.x.end(), x_.begin(), x_.end());
  s.lo.insert(s.lo.end(), lo_.begin(), lo_.end());
}

void OrbitApart::put_back(Assembly& a, const Scene& scene) const {
  if (!in_orbit_) return;
  try {
    a.spacecraft = std::make_shared<const space::Spacecraft>(
        a.mechanical, a.model, scene.orbit->environment, orbit_parts_of(scene));
  } catch (const InvalidArgument& e) {
    throw InvalidArgument(scene.orbit->where + ": " + e.what());
  }
  a.model = a.spacecraft;
  put_back(a.initial);
}

void OrbitApart::settle(mechanics::MovingMechanism& m) const {
  if (in_orbit_ || centre_apart_) settle_momentum(m.model->mechanism(), m.state);
}

MotorStates::MotorStates(const Scene& scene) {
  for (const JointActuator& a : scene.actuators) names_.push_back(a.name);
  for (const Element& e : scene.elements) names_.push_back(e.name);
  for (const Controller& c : scene.controllers)
    if (c.tank) names_.push_back(c.tank_name());
}

void MotorStates::take_off(const Assembly& a, phs::State& s) {
  if (const auto* network = dynamic_cast<const phs::NetworkModel*>(&a.internal()))
    for (const auto& name : names_) {
      if (!network->has(name)) continue;  // it has no state, or its joint is locked
      const long at = network->offset(name), n = network->member(name).description().nx;
      const auto part = [&](const std::vector<double>& of) {
        return std::vector<double>(of.begin() + at, of.begin() + at + n);
      };
      x_lo_[name] = {part(s.x), part(s.lo)};
    }
  const auto mechanism = size_t(a.mechanical->description().nx);
  s.x.resize(mechanism);
  s.lo.resize(mechanism);
}

void MotorStates::put_back(const phs::Model& model, phs::State& s) const {
  const auto* network = dynamic_cast<const phs::NetworkModel*>(&model);
  if (!network) return;
  s.x.resize(size_t(model.description().nx), 0.0);
  s.lo.resize(s.x.size(), 0.0);
  for (const auto& [name, own] : x_lo_) {
    if (!network->has(name)) continue;
    std::copy(own.first.begin(), own.first.end(), s.x.begin() + network->offset(name));
    std::copy(own.second.begin(), own.second.end(), s.lo.begin() + network->offset(name));
  }
}

void HeldOutputs::keep(const phs::Model& model, std::span<const double> memory) {
  values_.clear();
  for (const auto& hold : model.holds()) {
    if (memory.size() < hold->fresh.size())
      require_size("memory of the sampled controllers", memory.size(), hold->fresh.size());
    const auto own = memory.first(hold->fresh.size());
    values_[hold->name].assign(own.begin(), own.end());
    memory = memory.subspan(own.size());
  }
}

void HeldOutputs::put_in(const phs::Model& model) const {
  for (const auto& hold : model.holds())
    if (const auto known = values_.find(hold->name); known != values_.end())
      hold->fresh = known->second;
}

Joined joined_by(const std::vector<Happened>& happened, const mechanics::MovingMechanism& moving,
                 const mechanics::MechanicalModel& whole) {
  Joined all;
  const auto held = [&](const Event& e) {
    return std::ranges::any_of(moving.captured,
                               [&](const auto& c) { return c.link() == e.latch.body; });
  };
  std::set<std::string> seen;
  for (auto h = happened.rbegin(); h != happened.rend(); ++h) {  // the last of each counts
    const Event& e = *h->event;
    if (e.on_latch() || e.on_loop()) all.others.push_back(text(e));
    if (e.type == Event::Type::capture && held(e) && seen.insert("capture " + e.name).second)
      all.holds.push_back(
          {e.latch.body, e.latch.link, relative_pose(moving, e.latch.link, e.latch.body), {}});
    if (e.type == Event::Type::lock && moving.locked.contains(e.name) &&
        seen.insert("lock " + e.name).second)
      all.holds.push_back({"", "", {}, e.name});
  }
  std::ranges::reverse(all.holds);
  std::ranges::reverse(all.others);
  const auto& blocks = whole.description().blocks;
  const auto& coordinates = whole.mechanism().coordinates();
  for (const auto& [joint, lock] : moving.locked) {
    auto x = lock.q.begin(), low = lock.lo.begin();
    auto turns = lock.turns.begin();
    for (size_t i = 0; i < coordinates.size(); ++i) {
      if (coordinates[i].joint != joint) continue;
      const auto& b = blocks[i];
      auto& v = all.locked[link_name(b.name)];
      v = {{x, x + b.size}, {low, low + b.size}, 0};
      x += b.size;
      low += b.size;
      if (b.kind == phs::BlockKind::angle) v.turns = *turns++;
    }
  }
  return all;
}

/// At the end of a phase, whose mechanism its states are of.
void PhaseSequence::remember_nearest() {
  for (auto& [e, near] : nearest_) {
    Nearest& best = nearest_of_all_[e];
    if (!(near.margin > best.margin) || near.x.size() != moving_.state.x.size()) continue;
    auto there = moving_;
    there.state.x = near.x;
    near.then = Latching::hindrance(scene_, there, *e);
    best = near;
  }
}

std::vector<std::string> PhaseSequence::missed() const {
  std::vector<std::string> notes;
  for (const Event* e : waiting_) {
    std::string note = "it never happened: " + text(*e);
    if (from_ < e->after) {
      notes.push_back(note + fmt::format("; it waits from {:.6g} s on", e->after));
      continue;
    }
    const std::string why = Latching::hindrance(scene_, moving_, *e);
    if (!why.empty()) note += "; at the end of the run " + why;
    const auto near = nearest_of_all_.find(e);
    if (near != nearest_of_all_.end() && near->second.time < from_ && !near->second.then.empty())
      note += fmt::format("; nearest to all its limits at {:.6g} s, when {}", near->second.time,
                          near->second.then);
    notes.push_back(note);
  }
  return notes;
}

}  // namespace porthos::scene
