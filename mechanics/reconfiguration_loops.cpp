// Loops that an event closes or opens.
#include <cmath>

#include "mechanics/detail/instant.h"

namespace porthos::mechanics {
namespace {

using Real = Instant::Real;

Transform<Real> place_of(const LinkFrame& f, const Instant& now) {
  return now.pose(f.link) * Instant::lifted(f.pose);
}

/// Adds the parts of one spec to another, as the mechanism stands.
void add_as_it_stands(ConstraintSpec& all, ConstraintSpec closing, const Instant& now,
                      const LockedJoints& locked) {
  for (LoopJoint& l : closing.loops) {
    if (!l.points.empty())
      throw InvalidArgument("'" + l.name +
                            "' holds a point on a curve, expected a constraint that is closed from "
                            "the start, or another type");
    l.b.pose = lowered(inverse(now.pose(l.b.link)) * place_of(l.a, now));
    all.loops.push_back(std::move(l));
  }
  for (Rod& r : closing.rods) {
    r.length = length(place_of(r.b, now).r - place_of(r.a, now).r);
    all.rods.push_back(std::move(r));
  }
  for (Coupling& c : closing.couplings) {
    Real sum(0);
    for (const auto& t : c.terms) {
      const Real* at_lock = locked_value(locked, t.coordinate);
      sum +=
          Real(t.factor) * (at_lock ? *at_lock : now.q[size_t(now.m.coordinate(t.coordinate).q)]);
    }
    c.offset = double(sum);
    all.couplings.push_back(std::move(c));
  }
}

}  // namespace

const Real* locked_value(const LockedJoints& locked, const std::string& coordinate) {
  for (const auto& [joint, at_lock] : locked)
    if (const auto v = at_lock.values.find(coordinate); v != at_lock.values.end())
      return &v->second;
  return nullptr;
}

ConstraintSpec without_locked(ConstraintSpec all, const LockedJoints& locked) {
  for (Coupling& c : all.couplings) {
    Real offset = c.offset;
    std::erase_if(c.terms, [&](const Coupling::Term& t) {
      const Real* at_lock = locked_value(locked, t.coordinate);
      if (at_lock) offset -= Real(t.factor) * *at_lock;
      return at_lock != nullptr;
    });
    c.offset = double(offset);
  }
  std::erase_if(all.couplings, [](const Coupling& c) { return c.terms.empty(); });
  return all;
}

Impact close_loop(MovingMechanism& moving, ConstraintSpec closing) {
  ConstraintSpec all = moving.constraints;
  add_as_it_stands(all, std::move(closing), Instant(*moving.model, moving.state), moving.locked);
  return change(moving, moving.parts, std::move(all));
}

Impact open_loop(MovingMechanism& moving, const std::string& name) {
  ConstraintSpec left = moving.constraints;
  const auto remove = [&](auto& list) {
    return std::erase_if(list, [&](const auto& x) { return x.name == name; });
  };
  if (remove(left.loops) + remove(left.rods) + remove(left.couplings) == 0)
    throw InvalidArgument("open: the loop '" + name + "' is not closed, expected one that is");
  return change(moving, moving.parts, std::move(left));
}

}  // namespace porthos::mechanics
