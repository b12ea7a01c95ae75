#include "mechanics/constraints/maximal.h"

#include <cmath>

#include "mechanics/detail/body_checks.h"
#include "mechanics/detail/instant.h"
#include "mechanics/detail/tree_assembly.h"
#include "mechanics/joint_list.h"
#include "mechanics/momentum.h"

namespace porthos::mechanics {
namespace {

const std::string only_reduced =
    ", and maximal coordinates have no joint coordinates: expected coordinates = \"reduced\"";

/// What acts on a joint's coordinate itself, or "".
std::string acts_on_coordinate(const JointSpec& j) {
  if (j.stiffness != 0) return "a spring";
  if (j.damping != 0) return "a damper";
  if (j.rotor_inertia != 0) return "a rotor";
  return "";
}

/// The frame of a joint whose axes are those of loop joints: z the axis, x the second axis of a
/// universal joint.
Mat3<double> joint_axes(const BodySpec& b) {
  const Mat3<double> Z = frame_with_z(b.joint.axis);
  if (b.joint.type != Universal::name) return Z;
  if (!b.joint.second_axis) refuse_joint(b, "a universal joint has no second axis");
  const Vec3d x = (1 / norm(*b.joint.second_axis)) * *b.joint.second_axis;
  if (std::fabs(dot(x, Z.z)) > 1e-14)
    refuse_joint(b, "its axes are not normal to each other" + only_reduced);
  return {x, cross(Z.z, x), Z.z};
}

LoopJoint loop_of(const BodySpec& b) {
  if (const std::string what = acts_on_coordinate(b.joint); !what.empty())
    refuse_joint(b, what + " acts on its coordinate" + only_reduced);
  const Pose axes{joint_axes(b), {0, 0, 0}};
  return {b.joint.name.empty() ? b.name : b.joint.name,
          b.joint.type,
          {b.parent == "world" ? "" : b.parent, b.placement * axes},
          {b.name, axes},
          b.joint.pitch};
}

BodySpec free_body(const BodySpec& b) {
  BodySpec f = b;
  f.parent = "world";
  f.placement = BodySpec{}.placement;
  f.joint = JointSpec{};
  f.joint.name = b.joint.type == Free::name ? b.joint.name : b.name;
  f.joint.type = Free::name;
  f.joint.where = b.joint.where;
  return f;
}

template <class Named>
void refuse_coordinates(const std::vector<Named>& constraints, const char* what) {
  if (!constraints.empty())
    throw InvalidArgument("constraint '" + constraints.front().name + "': a " + what +
                          " acts on coordinates of joints" + only_reduced);
}

}  // namespace

MaximalForm maximal_form(const MechanismBuilder& tree, const ConstraintSpec& constraints) {
  refuse_coordinates(constraints.couplings, "coupling");
  refuse_coordinates(constraints.driven, "motion");
  MaximalForm form{tree, {}};
  for (BodySpec& b : form.parts.bodies()) {
    if (b.joint.type == Fixed::name) continue;
    if (b.joint.type != Free::name) form.constraints.loops.push_back(loop_of(b));
    if (b.joint.type != Free::name || b.parent != "world") b = free_body(b);
  }
  auto& loops = form.constraints.loops;
  loops.insert(loops.end(), constraints.loops.begin(), constraints.loops.end());
  form.constraints.rods = constraints.rods;
  form.constraints.rollings = constraints.rollings;
  try {
    form.parts.build();
  } catch (const MasslessPart& e) {
    throw InvalidArgument("body '" + e.joint + "' has no inertia of its own" + only_reduced);
  }
  return form;
}

phs::State maximal_state(const MechanicalModel& from, const phs::State& s,
                         const MechanicalModel& to) {
  using Real = Instant::Real;
  const Instant now(from, s);
  const Mechanism& m = to.mechanism();
  Instant::Reals q(size_t(m.nq())), v(size_t(m.nv())), p(q.size());
  std::vector<char> placed(m.nodes().size(), 0);
  for (const BodyFrame& body : m.bodies()) {
    if (body.node < 0 || placed[size_t(body.node)]) continue;
    placed[size_t(body.node)] = 1;
    const Node& n = m.nodes()[size_t(body.node)];
    const auto own = Instant::lifted(body.pose);
    const auto pose = inverse(Instant::lifted(n.placement)) * now.pose(body.name) * inverse(own);
    const auto twist = own.to_parent(now.twist(body.name));
    for (int k = 0; k < 3; ++k) {
      q[size_t(n.q + k)] = pose.r[k];
      v[size_t(n.v + k)] = twist.w[k];
      v[size_t(n.v + 3 + k)] = twist.v[k];
    }
    quaternion(pose.R).store(&q[size_t(n.q + 3)]);
  }
  Workspace<Real> w(m);
  momenta_from_rates<Real>(m, w, q, v, p);
  phs::State state(to.description(), std::vector<double>(2 * q.size()));
  for (size_t i = 0; i < 2 * q.size(); ++i) {
    const Real& x = i < q.size() ? q[i] : p[i - q.size()];
    state.x[i] = double(x);
    state.lo[i] = double(x - Real(state.x[i]));
  }
  return state;
}

double estimated_step(const MechanicalModel& model) {
  double time = 0.6 * double(model.mechanism().nodes().size());
  const ConstraintSet* const set = model.constraint_set();
  if (!set) return time;
  double operations = 0;  // of the factorisation
  for (const auto& front : set->pattern().fronts()) {
    const double b = front.size, below = double(front.below.size());
    operations += b * (b * b / 6 + b * below / 2 + below * below / 2);
  }
  return time + 2 * set->count() + 0.0075 * double(set->pattern().elements()) + 2e-5 * operations;
}

}  // namespace porthos::mechanics
