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
void add_as_it_stands(ConstraintSpec& all, ConstraintSpec closing, const Instant& now) {
  for (LoopJoint& l : closing.loops) {
    l.b.pose = lowered(inverse(now.pose(l.b.link)) * place_of(l.a, now));
    all.loops.push_back(std::move(l));
  }
  for (Rod& r : closing.rods) {
    r.length = length(place_of(r.b, now).r - place_of(r.a, now).r);
    all.rods.push_back(std::move(r));
  }
  for (Coupling& c : closing.couplings) {
    Real sum(0);
    for (const auto& t : c.terms)
      sum += Real(t.factor) * now.q[size_t(now.m.coordinate(t.coordinate).q)];
    c.offset = double(sum);
    all.couplings.push_back(std::move(c));
  }
}

}  // namespace

Impact close_loop(MovingMechanism& moving, ConstraintSpec closing) {
  for (const Coupling& c : closing.couplings)
    for (const auto& t : c.terms)
      for (const auto& [joint, at_lock] : moving.locked)
        if (t.coordinate == joint || t.coordinate.starts_with(joint + "."))
          throw InvalidArgument("the joint '" + joint + "' is locked, expected it unlocked before");
  ConstraintSpec all = moving.constraints;
  add_as_it_stands(all, std::move(closing), Instant(*moving.model, moving.state));
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
