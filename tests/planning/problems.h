#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "mechanics/builder.h"
#include "mechanics/mechanical_model.h"
#include "planning/planner.h"
#include "tests/support/reference.h"

/// Optimal control problems with known answers.
namespace porthos::test {

/// Cart and pendulum (Kelly 2017, SIAM Rev. 59): 1 kg and 0.3 kg on 0.5 m, g = 9.81. θ = 0 hangs.
inline std::shared_ptr<const mechanics::MechanicalModel> cart_pole() {
  mechanics::MechanismBuilder b("cart-pole");
  b.gravity({0, 0, -9.81});
  mechanics::BodySpec cart, pole;
  cart.name = "cart";
  cart.parent = "world";
  cart.joint.name = "slide";
  cart.joint.type = "prismatic";
  cart.joint.axis = {1, 0, 0};
  cart.mass.mass = 1;
  pole.name = "pole";
  pole.parent = "cart";
  pole.joint.name = "hinge";
  pole.joint.type = "revolute";
  pole.joint.axis = {0, -1, 0};
  pole.mass.mass = 0.3;
  pole.mass.com = {0, 0, -0.5};
  b.add(cart).add(pole);
  return std::make_shared<const mechanics::MechanicalModel>(
      std::make_shared<const mechanics::Mechanism>(b.build()));
}

/// Two uniform rods of 1 kg and 1 m, torque at the elbow. θ = 0 hangs.
inline std::shared_ptr<const mechanics::MechanicalModel> acrobot() {
  mechanics::MechanismBuilder b("acrobot");
  b.gravity({0, 0, -9.81});
  for (const std::string name : {"upper", "lower"}) {
    mechanics::BodySpec rod;
    rod.name = name;
    rod.parent = name == "upper" ? "world" : "upper";
    rod.joint.name = name == "upper" ? "shoulder" : "elbow";
    rod.joint.type = "revolute";
    rod.joint.axis = {0, -1, 0};
    if (name == "lower") rod.placement.r = {0, 0, -1};
    rod.mass.mass = 1;
    rod.mass.com = {0, 0, -0.5};
    rod.mass.inertia = {1. / 12, 0, 0, 1. / 12, 0, 0};
    b.add(rod);
  }
  return std::make_shared<const mechanics::MechanicalModel>(
      std::make_shared<const mechanics::Mechanism>(b.build()));
}

/// Every number of the end is a goal.
inline std::vector<planning::Goal> ends_at(const std::vector<double>& x) {
  std::vector<planning::Goal> goals;
  for (size_t k = 0; k < x.size(); ++k) goals.push_back({{{int(k), 1.0}}, -1, x[k]});
  return goals;
}

/// A unit mass from rest to rest over `way` at the cost ∫u².
inline planning::Problem unit_mass(double way, double duration, int intervals) {
  planning::Problem p;
  p.dynamics = planning::function_dynamics(2, 1, [](double, auto x, auto u, auto dx) {
    dx[0] = x[1];
    dx[1] = u[0];
  });
  p.duration = duration;
  p.intervals = intervals;
  p.start = {0, 0};
  p.cost.input = {1};
  p.goals = ends_at({way, 0});
  return p;
}

inline planning::Problem cart_pole_swing_up(int stages, int intervals) {
  planning::Problem p;
  p.dynamics = planning::dynamics_of(cart_pole(), {"slide.force"});
  p.stages = stages;
  p.duration = 2;
  p.intervals = intervals;
  p.inputs = planning::Inputs::at_stages;
  p.start = {0, 0, 0, 0};
  p.cost.input = {1};
  p.goals = ends_at({1, M_PI, 0, 0});
  return p;
}

inline planning::Problem acrobot_swing_up() {
  planning::Problem p;
  p.dynamics = planning::dynamics_of(acrobot(), {"elbow.torque"});
  p.stages = 4;
  p.duration = 4;
  p.intervals = 80;
  p.inputs = planning::Inputs::at_stages;
  p.start = {0, 0, 0, 0};
  p.cost.input = {1};
  p.goals = ends_at({M_PI, 0, 0, 0});
  return p;
}

/// A table of four digits (tests/data/README.md).
inline planning::Trajectory acrobot_guess(const planning::Problem& p) {
  planning::Trajectory guess = planning::straight(p, {M_PI, 0, 0, 0});
  std::ifstream file(data_file("planning/acrobot_guess.txt"));
  for (auto* list : {&guess.x, &guess.u})
    for (double& number : *list) file >> number;
  EXPECT_TRUE(file.good());
  return guess;
}

/// A mass in the plane from (-1, 0) to (1, 0) m in 2 s, at rest at both ends, at least ∫u², no
/// nearer than 1/2 m to the origin.
inline planning::Problem round_a_disc(int intervals) {
  planning::Problem p;
  p.dynamics = planning::function_dynamics(4, 2, [](auto, auto x, auto u, auto dx) {
    dx[0] = x[2];
    dx[1] = x[3];
    dx[2] = u[0];
    dx[3] = u[1];
  });
  p.intervals = intervals;
  p.duration = 2;
  p.start = {-1, 0, 0, 0};
  p.cost.input = {1, 1};
  p.goals = ends_at({1, 0, 0, 0});
  const auto distance = [](double, auto x) {
    using phs::sqrt;
    return sqrt(x[0] * x[0] + x[1] * x[1]);
  };
  p.limits.path = {{.number = planning::path_number(4, distance), .lower = 0.5}};
  return p;
}

/// A straight line whose inner states are moved to a side of the disc.
inline planning::Trajectory beside_the_disc(const planning::Problem& p, double side) {
  planning::Trajectory guess = planning::straight(p, {1, 0, 0, 0});
  for (int k = 1; k < p.intervals; ++k) guess.x[size_t(4 * k + 1)] = side;
  return guess;
}

}  // namespace porthos::test
