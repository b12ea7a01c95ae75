#include "scene/sensitivity/event_chain.h"

#include <fmt/format.h>

#include <algorithm>

#include "mechanics/rotation.h"

namespace porthos::scene {
namespace {

using mechanics::Mat3;
using mechanics::MovingMechanism;
using mechanics::Pose;
using mechanics::Vec3d;
using Type = Event::Type;

constexpr int numbers_of_pose = 6;

/// The turn by an angle about an axis of the frame.
Mat3<double> turn_about(int axis, double angle) {
  Vec3d half{0, 0, 0};
  half[axis] = std::sin(angle / 2);
  return mechanics::rotation_matrix(mechanics::Quaternion<double>{std::cos(angle / 2), half});
}

/// The place of a pose beside another, and sin θ u of its turn from it, in the axes of the body.
void add_pose(const Pose& pose, const Pose& from, Left& to) {
  for (int k = 0; k < 3; ++k) to.push_back(pose.r[k]);
  const Mat3<double> turn = from.R.transposed() * pose.R;
  to.push_back((turn.y.z - turn.z.y) / 2);
  to.push_back((turn.z.x - turn.x.z) / 2);
  to.push_back((turn.x.y - turn.y.x) / 2);
}

/// Line of a table in its file, from "file:line:column".
long line_of(const Event& e) {
  return std::stol(e.where.substr(e.where.rfind(':', e.where.rfind(':') - 1) + 1));
}

}  // namespace

std::vector<double> whole_state(const MovingMechanism& moving) {
  auto x = phs::with_turns(moving.model->description(), moving.state);
  for (size_t k = 0; k < x.size(); ++k) x[k] += moving.state.lo[k];
  return x;
}

std::string key_of(const Scene& scene, const Event& e) {
  return fmt::format("event[{}]", std::ranges::count_if(scene.events, [&](const Event& other) {
                       return line_of(other) < line_of(e);
                     }));
}

EventChain::EventChain(const Scene& scene, const Assembly& assembly, const MovingMechanism& start)
    : scene_(scene),
      whole_(assembly),
      orbit_(assembly),
      motors_(scene),
      moving_(start),
      latching_(scene) {}

void EventChain::add(const Event& event, double at, size_t phase, const phs::State* state) {
  if (state) moving_.state = *state;
  moving_.time = at;
  Happening h{without_limits(event), phase, moving_, latching_};
  h.event.at = at;
  int numbers = 0;
  if (event.type == Type::lock)
    for (const auto& c : moving_.model->mechanism().coordinates())
      for (int k = 0; k < c.nq && c.joint == event.name; ++k, ++numbers)
        h.coordinates.push_back(size_t(c.q + k));
  if (event.type == Type::capture) {
    h.pose = relative_pose(moving_, event.latch.link, event.latch.body);
    numbers = numbers_of_pose;
  }
  for (int k = 0; k < numbers; ++k)
    frozen_.push_back({list_.size(), k, fmt::format("{} at {:g} s[{}]", text(event), at, k)});
  list_.push_back(std::move(h));
  Beside b{moving_, latching_};
  (void)apply(list_.size() - 1, b);
  moving_ = std::move(b.moving);
  latching_ = std::move(b.latching);
}

Left EventChain::apply(size_t i, Beside& b) const {
  const Happening& h = list_[i];
  Left frozen;
  const auto x = whole_state(b.moving);
  for (const size_t at : h.coordinates) frozen.push_back(x[at]);
  if (h.event.type == Type::capture)
    add_pose(relative_pose(b.moving, h.event.latch.link, h.event.latch.body), h.pose, frozen);
  apply_one(scene_, h.event, b.moving, b.latching, orbit_);
  Left all = whole_state(b.moving);
  all.insert(all.end(), frozen.begin(), frozen.end());
  return all;
}

void EventChain::apply_as_on_run(size_t i, Beside& b) const {
  const Happening& h = list_[i];
  if (h.event.type == Type::capture)
    move_with(b.moving, h.event.latch.link, h.event.latch.body, h.pose);
  (void)apply(i, b);
}

Left EventChain::with_state(size_t i, size_t k, double d) const {
  Beside b{list_[i].before, list_[i].latching};
  b.moving.state.x[k] += d;
  return apply(i, b);
}

EventChain::Beside EventChain::with_frozen(const FrozenNumber& number, double d) const {
  const Happening& h = list_[number.happening];
  Beside b{h.before, h.latching};
  if (h.event.type == Type::capture) {
    Pose pose = h.pose;
    if (number.number < 3)
      pose.r[number.number] += d;
    else
      pose.R = pose.R * turn_about(number.number - 3, d);
    move_with(b.moving, h.event.latch.link, h.event.latch.body, pose);
  } else {
    b.moving.state.x[h.coordinates[size_t(number.number)]] += d;
  }
  (void)apply(number.happening, b);
  return b;
}

std::pair<Scene, Assembly> EventChain::phase_after(const Beside& b, double end) const {
  std::pair<Scene, Assembly> phase{phase_of(scene_, b.moving, b.latching, end), {whole_}};
  phase.second = assembly_of_phase(phase.first, whole_, b.moving, motors_, orbit_);
  return phase;
}

bool EventChain::lasts(const FrozenNumber& number, size_t count) const {
  const MovingMechanism& m = count < list_.size() ? list_[count].before : moving_;
  const Event& e = list_[number.happening].event;
  if (e.type == Type::lock) return m.locked.contains(e.name);
  return std::ranges::any_of(m.captured, [&](const auto& c) { return c.link() == e.latch.body; });
}

}  // namespace porthos::scene
