#pragma once
#include "tests/support/robots.h"

namespace porthos::test {

/// The double pendulum, started over the top: H = 6.6 J between -29 J and 29 J of potential energy.
inline Robot swinging_pendulum(double damping = 0) {
  mechanics::MechanismBuilder b("pendulum");
  b.gravity({0, -9.81, 0});
  for (const char* name : {"upper", "lower"}) {
    mechanics::BodySpec s;
    s.name = name;
    s.parent = std::string(name) == "upper" ? "world" : "upper";
    s.joint.type = "revolute";
    s.joint.damping = damping;
    if (s.parent != "world") s.placement.r = {0, -1, 0};
    s.mass = {1, {0, -0.5, 0}, {1. / 24, 0, 0, 1. / 24, 0, 1. / 12}};
    b.add(s);
  }
  Robot r;
  r.model = std::make_shared<mechanics::MechanicalModel>(
      std::make_shared<mechanics::Mechanism>(b.build()));
  r.start = phs::State(r.model->description(), {2.0, -0.4, 1.1, 0.5});
  return r;
}

}  // namespace porthos::test
