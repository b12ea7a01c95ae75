#include "scene/identification/observation.h"

#include <algorithm>

#include "mechanics/rotation.h"

namespace porthos::scene {

/// Calls visit(Observed, OfJoint) for each number of a joint.
template <class Visit>
void Observation::each_of_joints(const Assembly& a, const Visit& visit) {
  using Kind = OfJoint::Kind;
  const auto& m = *a.mechanism;
  for (const auto& c : m.coordinates()) {
    const bool wraps = c.kind == phs::BlockKind::angle;
    if (c.nv == 1) {
      visit(Observed{c.name + ".position", c.unit, wraps}, OfJoint{Kind::position, c.q});
      visit(Observed{c.name + ".velocity", c.rate_unit}, OfJoint{Kind::velocity, c.v});
      continue;
    }
    const auto three = component_suffixes(3);
    for (int k = 0; k < 3; ++k) {
      const std::string end = "." + three[size_t(k)];
      if (c.kind == phs::BlockKind::rotation) {
        visit(Observed{c.joint + ".angular_velocity" + end, "rad/s"},
              OfJoint{Kind::velocity, c.v + k});
        continue;
      }
      visit(Observed{c.joint + ".position" + end, "m"}, OfJoint{Kind::position, c.q + k});
      visit(Observed{c.joint + ".linear_velocity" + end, "m/s"},
            OfJoint{Kind::linear_velocity, c.v, m.coordinate(c.joint + ".attitude").q, k});
    }
  }
}

std::vector<Observed> observable(const Scene& scene, const Assembly& a) {
  std::vector<Observed> all;
  const auto columns = output_columns(scene, a);
  for (size_t i = 0; i < scene.outputs.size(); ++i)
    for (const auto& name : component_names(scene.outputs[i]))
      all.push_back({name, columns[i].unit, columns[i].unit == "rad"});
  Observation::each_of_joints(a, [&](const Observed& o, const auto&) {
    if (std::ranges::find(all, o.name, &Observed::name) == all.end()) all.push_back(o);
  });
  return all;
}

Observation::Observation(const Scene& scene, const Assembly& a,
                         const std::vector<std::string>& names)
    : assembly_(a) {
  const auto of_outputs = number_names(scene.outputs);
  for (const auto& name : names) {
    const auto at = std::ranges::find(of_outputs, name);
    if (at != of_outputs.end()) {
      numbers_.push_back({int(at - of_outputs.begin())});
      if (!outputs_) outputs_.emplace(scene, a);
      continue;
    }
    each_of_joints(a, [&](const Observed& o, const OfJoint& joint) {
      if (o.name == name) numbers_.push_back({-1, joint});
    });
    rates_ = rates_ || numbers_.back().joint.kind != OfJoint::Kind::position;
  }
}

void Observation::at(double t, const phs::State& s, std::span<double> to) {
  using Kind = OfJoint::Kind;
  const auto nq = size_t(assembly_.mechanism->nq());
  const auto q = phs::with_turns(assembly_.model->description(), s);
  const auto v = rates_ ? assembly_.mechanical->rates(std::span(s.x).first(2 * nq), s.turns)
                        : std::vector<double>();
  const auto outputs = outputs_ ? outputs_->at(t, s, {}) : std::span<const double>();
  for (size_t i = 0; i < numbers_.size(); ++i) {
    const OfJoint& j = numbers_[i].joint;
    if (numbers_[i].output >= 0) {
      to[i] = outputs[size_t(numbers_[i].output)];
    } else if (j.kind == Kind::position) {
      to[i] = q[size_t(j.at)];
    } else if (j.kind == Kind::velocity) {
      to[i] = v[size_t(j.at)];
    } else {
      const double* u = &v[size_t(j.at)];
      to[i] =
          (mechanics::rotation_matrix(mechanics::Quaternion<double>::load(&q[size_t(j.attitude)])) *
           mechanics::Vec3d{u[0], u[1], u[2]})[j.axis];
    }
  }
}

}  // namespace porthos::scene
