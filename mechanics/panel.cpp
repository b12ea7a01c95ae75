#include "mechanics/panel.h"

#include <cmath>

#include "phs/error.h"

namespace porthos::mechanics {
namespace {

void require_positive(const Panel& p, const char* what, double x) {
  if (x > 0 && std::isfinite(x)) return;
  throw InvalidArgument(in_file(p.where) + "panel '" + p.name + "': its " + what + " is " +
                        std::to_string(x) + ", expected a positive number");
}

/// A thin plate of mass m from x = 0 to x = a.
MassProperties plate(double m, double a, double width) {
  MassProperties p;
  p.mass = m;
  p.com = {a / 2, 0, 0};
  p.inertia.xx = m * width * width / 12;
  p.inertia.yy = m * a * a / 12;
  p.inertia.zz = p.inertia.xx + p.inertia.yy;
  return p;
}

}  // namespace

double bending_frequency(const Panel& p, int n) {
  constexpr double lambda[] = {1.8751040687119611, 4.6940911329741746, 7.8547574382376126};
  const double L = p.length;
  return lambda[n - 1] * lambda[n - 1] *
         std::sqrt(p.bending_stiffness / (p.mass / L * L * L * L * L));
}

void add_panel(MechanismBuilder& b, const Panel& p) {
  require_positive(p, "length", p.length);
  require_positive(p, "mass", p.mass);
  require_positive(p, "bending stiffness", p.bending_stiffness);
  require_positive(p, "number of segments", p.segments);
  if (!(p.width >= 0) || !(p.damping_ratio >= 0))
    throw InvalidArgument(in_file(p.where) + "panel '" + p.name +
                          "': a width or damping ratio is below 0, expected 0 or more");
  const double l = p.length / p.segments, k = p.bending_stiffness / l;
  const auto piece = [&](const std::string& name, double length) {
    BodySpec s;
    s.name = name;
    s.where = p.where;
    s.mass = plate(p.mass * length / p.length, length, p.width);
    return s;
  };
  BodySpec root = piece(p.name + "_root", l / 2);
  root.parent = p.link;
  root.placement = p.root;
  root.joint.name = p.name + "_clamp";
  root.joint.type = "fixed";
  b.add(root);
  std::string parent = root.name;
  for (int i = 1; i <= p.segments; ++i) {
    const std::string name = p.name + "_" + std::to_string(i);
    BodySpec s = piece(name + "_segment", i < p.segments ? l : l / 2);
    s.parent = parent;
    s.placement.r = {i == 1 ? l / 2 : l, 0, 0};
    s.joint.name = name;
    s.joint.type = "revolute";
    s.joint.axis = {0, 1, 0};
    s.joint.stiffness = k;
    s.joint.damping = 2 * p.damping_ratio / bending_frequency(p, 1) * k;
    b.add(s);
    parent = s.name;
  }
}

}  // namespace porthos::mechanics
