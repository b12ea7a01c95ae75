#include "scene/run/latching.h"

#include <fmt/format.h>

#include <algorithm>

#include "scene/run/loop_events.h"

namespace porthos::scene {
namespace {

const Element* find_latch(const Scene& scene, const std::string& name) {
  for (const Element& e : scene.elements)
    if (e.latch && e.name == name) return &e;
  return nullptr;
}
/// A line spring can let go, but has no pose in which it could take hold.
void check_latch(const Scene& scene, const Event& e) {
  const Element* latch = find_latch(scene, e.name);
  if (latch && (latch->type == "soft_latch" || e.type == Event::Type::disengage)) return;
  throw InvalidArgument(e.where + ": there is no soft latch '" + e.name +
                        "', expected the name of an element of type \"soft_latch\"");
}

bool are_one(const mechanics::Mechanism& m, const space::SoftLatch& l) {
  return l.body != "world" && m.body(l.link).node == m.body(l.body).node;
}

/// The limits of an event, between the points of a soft latch.
mechanics::Latch limits_of(const Scene& scene, const Event& e) {
  if (e.type == Event::Type::close) return limits_of_closing(scene, e);
  mechanics::Latch l = e.latch;
  if (e.type != Event::Type::engage) return l;
  const space::SoftLatch& soft = *find_latch(scene, e.name)->latch;
  l.link = soft.link;
  l.body = soft.body;
  l.on_link = soft.on_link.r;
  l.on_body = soft.on_body.r;
  return l;
}

/// A joint's coordinate, full turns included.
double angle(const mechanics::MechanicalModel& model, const phs::State& s, const Event& e) {
  std::string known;
  size_t turn = 0;
  for (const auto& c : model.mechanism().coordinates()) {
    const bool is_angle = c.kind == phs::BlockKind::angle;
    if (c.nq == 1) {
      add_to_list(known, c.name);
      if (c.name == e.name)
        return s.x[size_t(c.q)] + s.lo[size_t(c.q)] +
               (is_angle ? phs::two_pi_hi * double(s.turns[turn]) : 0);
    }
    if (is_angle) ++turn;
  }
  throw InvalidArgument(
      fmt::format("{}: the event waits for '{}', expected a coordinate of one number: "
                  "{}",
                  e.where, e.name, known.empty() ? "(none)" : known));
}

}  // namespace

Latching::Latching(const Scene& scene) {
  for (const Event& e : scene.events)
    if (e.on_latch()) check_latch(scene, e);
  for (const Element& e : scene.elements)
    if (e.latch && std::none_of(scene.events.begin(), scene.events.end(), [&](const Event& v) {
          return v.type == Event::Type::engage && v.name == e.name;
        }))
      engaged_[e.name] = e.latch->on_body;
}

void Latching::apply_to(Scene& phase, const mechanics::Mechanism& now) const {
  std::erase_if(phase.elements, [&](const Element& e) {
    return e.latch && (!engaged_.count(e.name) || are_one(now, *e.latch));
  });
  for (Element& e : phase.elements)
    if (e.latch) e.latch->on_body = engaged_.at(e.name);
}

mechanics::Impact Latching::change(const Scene& scene, const mechanics::MovingMechanism& moving,
                                   const Event& e) {
  const auto refuse = [&](const std::string& why) {
    throw InvalidArgument(fmt::format("{}: soft latch '{}' {}", e.where, e.name, why));
  };
  const auto& m = moving.model->mechanism();
  mechanics::Workspace<double> w(m);
  w.set_turns(moving.state.turns);
  const size_t nq = size_t(m.nq());
  const std::span<const double> x(moving.state.x);
  mechanics::Impact r;
  r.momentum = mechanics::momentum<double>(m, w, x.first(nq), x.subspan(nq, nq));
  const bool holds = engaged_.count(e.name) > 0;
  space::SoftLatch latch = *find_latch(scene, e.name)->latch;
  if (e.type == Event::Type::engage) {
    if (holds) refuse("is engaged already, expected one that is not");
    try {
      mechanics::require_within_limits(moving, limits_of(scene, e), text(e));
    } catch (const InvalidArgument& why) {
      throw InvalidArgument(fmt::format("{}: {}", e.where, why.what()));
    }
    const auto there = mechanics::relative_pose(moving, latch.link, latch.body);
    // on_body such that both frames coincide: link -> body of on_link
    const auto& R = there.R;
    engaged_[e.name] = {R.transposed() * latch.on_link.R, R.tmul(latch.on_link.r - there.r)};
    return r;
  }
  if (!holds) refuse("is not engaged, expected one that is");
  if (are_one(m, latch))
    refuse("rests while '" + latch.link + "' and '" + latch.body +
           "' are one, expected to be disengaged before or after that");
  latch.on_body = engaged_.at(e.name);
  const space::PartsModel model(moving.model, space::Parts{.latches = {latch}});
  const auto system = model.instantiate<long double>();
  std::vector<long double> y(2 * nq), turns;
  for (size_t i = 0; i < y.size(); ++i) y[i] = (long double)x[i] + moving.state.lo[i];
  for (const auto n : moving.state.turns) turns.push_back(double(n) * phs::two_pi_hi);
  system->set_turn_angles(turns);
  std::vector<long double> stored(model.description().storages.size());
  system->stored(y, stored);
  r.dissipated_J = double(stored.back());
  engaged_.erase(e.name);
  return r;
}

double Latching::margin(const Scene& scene, const mechanics::MovingMechanism& moving,
                        const phs::State& state, double time, const Event& e) {
  const double waited = time - e.after;
  if (e.above) return std::min(waited, angle(*moving.model, state, e) - *e.above);
  if (e.below) return std::min(waited, *e.below - angle(*moving.model, state, e));
  return std::min(waited, mechanics::margin(moving, state, limits_of(scene, e)));
}

std::string Latching::hindrance(const Scene& scene, const mechanics::MovingMechanism& moving,
                                const Event& e) {
  if (e.above || e.below)
    return fmt::format("the angle is {:.6g} rad, expected {} {:.6g} rad",
                       angle(*moving.model, moving.state, e), e.above ? "above" : "below",
                       e.above ? *e.above : *e.below);
  return mechanics::beyond_limits(moving, limits_of(scene, e));
}

}  // namespace porthos::scene
