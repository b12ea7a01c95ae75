#include "mechanics/detail/tree_assembly.h"

#include <cmath>
#include <map>
#include <set>

#include "mechanics/detail/body_checks.h"
#include "mechanics/joint_list.h"

namespace porthos::mechanics {

Mat3<double> frame_with_z(const Vec3d& axis) {
  const double length = norm(axis);
  const Vec3d z = (1 / length) * axis;
  const auto along = [&](double x, double y, double w) { return z.x == x && z.y == y && z.z == w; };
  if (along(0, 0, 1)) return Mat3<double>::identity();
  if (along(0, 0, -1)) return {{1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
  if (along(1, 0, 0)) return {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
  if (along(-1, 0, 0)) return {{0, 1, 0}, {0, 0, -1}, {-1, 0, 0}};
  if (along(0, 1, 0)) return {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}};
  if (along(0, -1, 0)) return {{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}};
  // Any other axis: complete to a basis in extended precision, round once.
  const Vec3<long double> a(axis);
  const Vec3<long double> Z = (1 / norm(a)) * a;
  const Vec3<long double> pick =
      std::fabs(z.x) < 0.6 ? Vec3<long double>{1, 0, 0} : Vec3<long double>{0, 1, 0};
  Vec3<long double> X = pick - dot(pick, Z) * Z;
  X = (1 / norm(X)) * X;
  return Mat3<double>(Mat3<long double>{X, cross(Z, X), Z});
}

namespace {

Pose inverse(const Pose& p) { return {p.R.transposed(), -p.R.tmul(p.r)}; }

/// The rigid inertia of a body in the frame in which the body's own frame has the given pose.
RigidInertia<double> inertia_in(const MassProperties& m, const Pose& pose) {
  using E = long double;  // rounded once
  const Mat3<E> R = Mat3<E>(pose.R) * Mat3<E>(m.axes);
  const Vec3<E> c = Vec3<E>(pose.r) + Mat3<E>(pose.R) * Vec3<E>(m.com);
  const E mass = m.mass;
  Sym3<E> I = rotated(R, Sym3<E>(m.inertia));
  const E d = dot(c, c);
  I.xx += mass * (d - c.x * c.x);
  I.yy += mass * (d - c.y * c.y);
  I.zz += mass * (d - c.z * c.z);
  I.xy -= mass * c.x * c.y;
  I.xz -= mass * c.x * c.z;
  I.yz -= mass * c.y * c.z;
  return {m.mass, Vec3d(mass * c), Sym3<double>(I)};
}

void add_to(RigidInertia<double>& a, const RigidInertia<double>& b) {
  a = {a.m + b.m, a.mc + b.mc, a.I + b.I};
}

/// The index of a primitive joint by name; -1 if there is none.
int primitive_index(std::string_view name) {
  int index = -1, i = 0;
  for_each_joint(PrimitiveJoints{}, [&](auto J) {
    if (decltype(J)::name == name) index = i;
    ++i;
  });
  return index;
}

/// Builds the node tree body by body; frames maps each body to its node and pose there.
class TreeAssembly {
 public:
  AssembledTree run(const std::vector<const BodySpec*>& order, bool accept_unphysical) {
    for (const auto* b : order) add(*b);
    check_inertias(order, accept_unphysical);
    return std::move(r_);
  }

 private:
  void add(const BodySpec& b) {
    check_numbers(b);
    const BodyFrame world{"world", -1, {Mat3<double>::identity(), {0, 0, 0}}};
    const BodyFrame parent = b.parent == "world" ? world : r_.bodies[frames_.at(b.parent)];
    body_ = &b;
    node_ = parent.node;
    here_ = parent.pose * b.placement;
    const int first_freedom = r_.nv;

    bool known = false;
    if (primitive_index(b.joint.type) >= 0) {
      known = true;
      append(b.joint.type, axis(b.joint.axis), "");
    }
    for_each_joint(ChainJoints{}, [&](auto J) {
      if (decltype(J)::name != b.joint.type) return;
      known = true;
      for (const ChainLink& link : decltype(J)::chain)
        append(link.primitive, chain_axis(link.axis), link.suffix);
    });
    if (!known)
      refuse_joint(b, "unknown type '" + b.joint.type + "', expected one of " +
                          listed(joint_type_names(), [](const auto& n) { return n; }));
    add_properties(b, r_.nv - first_freedom);
    frames_[b.name] = r_.bodies.size();
    r_.bodies.push_back({b.name, node_, here_});
    if (node_ < 0) return;
    MassProperties mass = b.mass;
    if (const double lifted = lift_to_zero(mass); lifted < 0)
      r_.remarks.push_back({b.where, "body '" + b.name + "': its principal moment " +
                                         number(lifted) +
                                         " kg m^2 is below zero by rounding, "
                                         "taken as zero"});
    add_to(r_.nodes[size_t(node_)].inertia, inertia_in(mass, here_));
  }

  /// Only the inertia of a whole moving body enters the dynamics. A faulty link merged into a sound
  /// body gives a remark. A faulty moving body is an error that names the link to correct.
  void check_inertias(const std::vector<const BodySpec*>& order, bool accept_unphysical) {
    std::map<int, const BodySpec*> culprit;
    for (const auto* b : order) {
      const int node = r_.bodies[frames_.at(b->name)].node;
      const std::string fault = inertia_fault(b->mass.mass, b->mass.inertia);
      if (fault.empty() || node < 0) continue;
      r_.remarks.push_back(
          {b->where,
           "body '" + b->name + "': " + fault + "; tolerated because " +
               (accept_unphysical ? "unphysical inertias were accepted"
                                  : "the moving body it is fixed to is sound as a whole")});
      if (!culprit.count(node)) culprit[node] = b;
    }
    for (const auto& [node, b] : culprit) {
      const auto& whole = r_.nodes[size_t(node)].inertia;
      const auto total = whole.m > 0 ? about_centre(whole) : whole.I;
      const bool positive = whole.m > 0 && smallest_principal_moment(total) > 0;
      if (accept_unphysical ? positive : inertia_fault(whole.m, total).empty()) continue;
      const std::string fault = inertia_fault(b->mass.mass, b->mass.inertia);
      if (accept_unphysical || !positive) refuse(*b, fault);
      throw UnphysicalInertia(in_file(b->where) + "body '" + b->name + "': " + fault);
    }
  }
  static Sym3<double> about_centre(const RigidInertia<double>& r) {
    const Vec3d c = (1 / r.m) * r.mc;
    const double d = dot(c, c);
    return {r.I.xx - r.m * (d - c.x * c.x), r.I.xy + r.m * c.x * c.y,
            r.I.xz + r.m * c.x * c.z,       r.I.yy - r.m * (d - c.y * c.y),
            r.I.yz + r.m * c.y * c.z,       r.I.zz - r.m * (d - c.z * c.z)};
  }

  Vec3d axis(const Vec3d& a) const {
    if (!finite(a) || norm(a) == 0)
      refuse_joint(*body_, "its axis is zero or not finite, expected a direction");
    return a;
  }
  Vec3d chain_axis(ChainAxis which) const {
    const Vec3d first = axis(body_->joint.axis);
    const Mat3<double> basis = frame_with_z(first);
    if (which == ChainAxis::first) return first;
    Vec3d second = body_->joint.second_axis ? axis(*body_->joint.second_axis) : basis.x;
    if (norm(cross(second, first)) < 1e-9 * norm(second) * norm(first))
      refuse_joint(*body_, "its two axes are parallel, expected different directions");
    if (body_->joint.type == "planar")
      second = second - (dot(second, first) / dot(first, first)) * first;
    if (which == ChainAxis::second) return second;
    return cross(first, second);
  }

  /// Appends one primitive joint after the frame here_ of node_. Afterwards node_ is the new node
  /// and here_ the user's frame in it.
  void append(std::string_view primitive, const Vec3d& axis, const char* suffix) {
    const int type = primitive_index(primitive);
    const bool oriented = primitive != "spherical" && primitive != "free";
    const Mat3<double> Z = oriented ? frame_with_z(axis) : Mat3<double>::identity();

    Node n;
    n.type = type;
    n.parent = node_;
    n.q = r_.nq;
    n.v = r_.nv;
    n.placement = here_ * Pose{Z, {0, 0, 0}};
    n.pitch = body_->joint.pitch;
    n.rotor_inertia = body_->joint.rotor_inertia;
    n.inertia = {0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}};
    if (!std::isfinite(n.pitch)) refuse_joint(*body_, "its pitch is not finite");
    const std::string joint = body_->joint.name.empty() ? body_->name : body_->joint.name;
    visit_joint(type, [&](auto J) {
      int q = r_.nq, v = r_.nv;
      for (const CoordinateBlock& c : decltype(J)::blocks) {
        const int nv = c.kind == phs::BlockKind::rotation ? 3 : c.size;
        JointCoordinates jc{joint + suffix + c.suffix,
                            joint,
                            c.kind,
                            int(r_.nodes.size()),
                            q,
                            c.size,
                            v,
                            nv,
                            c.unit,
                            c.momentum_unit,
                            c.effort_unit,
                            c.rate_unit};
        if (decltype(J)::name == "free")
          jc.v = c.kind == phs::BlockKind::rotation ? r_.nv : r_.nv + 3;
        if (c.kind == phs::BlockKind::angle) n.turn = r_.angles++;
        if (!coordinate_names_.insert(jc.name).second)
          refuse_joint(*body_, "its coordinate '" + jc.name + "' has the name of another joint's");
        r_.coordinates.push_back(jc);
        q += c.size;
        v += nv;
      }
      r_.nq += decltype(J)::nq;
      r_.nv += decltype(J)::nv;
    });
    node_ = int(r_.nodes.size());
    here_ = inverse(Pose{Z, {0, 0, 0}});
    r_.nodes.push_back(n);
  }

  void add_properties(const BodySpec& b, int freedoms) {
    const JointSpec& j = b.joint;
    const bool has = j.damping != 0 || j.stiffness != 0 || j.friction != 0 || j.lower || j.upper ||
                     j.effort || j.rate || j.rotor_inertia != 0;
    if (!(j.damping >= 0 && j.damping < HUGE_VAL))
      refuse_joint(b, "damping is " + number(j.damping) + ", expected a finite number >= 0");
    if (!(j.stiffness >= 0 && j.stiffness < HUGE_VAL))
      refuse_joint(b, "stiffness is " + number(j.stiffness) + ", expected a finite number >= 0");
    if (!(j.friction >= 0 && j.friction < HUGE_VAL))
      refuse_joint(b, "friction is " + number(j.friction) + ", expected a finite number >= 0");
    if (!(j.rotor_inertia >= 0 && j.rotor_inertia < HUGE_VAL))
      refuse_joint(
          b, "rotor inertia is " + number(j.rotor_inertia) + ", expected a finite number >= 0");
    if (j.rotor_inertia > 0 && freedoms != 1)
      refuse_joint(b, "a rotor inertia needs a joint of one degree of freedom, '" + j.type +
                          "' has " + std::to_string(freedoms));
    if (!std::isfinite(j.rest)) refuse_joint(b, "rest is not finite");
    if (j.lower && j.upper && !(*j.lower <= *j.upper))
      refuse_joint(
          b, "lower limit " + number(*j.lower) + " is above the upper one, " + number(*j.upper));
    if (!has || freedoms == 0) return;
    const Node& n = r_.nodes.back();
    if (freedoms != 1) {
      if (j.damping != 0 || j.stiffness != 0)
        refuse_joint(b, "damping and stiffness need a joint of one degree of freedom, '" + j.type +
                            "' has several");
      return;
    }
    r_.properties.push_back({j.name.empty() ? b.name : j.name, n.q, n.v, n.turn, j.damping,
                             j.stiffness, j.rest, j.friction, j.lower, j.upper, j.effort, j.rate,
                             j.rotor_inertia});
  }

  AssembledTree r_;
  std::map<std::string, size_t> frames_;
  std::set<std::string> coordinate_names_;
  const BodySpec* body_ = nullptr;
  int node_ = -1;
  Pose here_{};
};

}  // namespace

AssembledTree assemble_tree(const std::vector<const BodySpec*>& order, bool accept_unphysical) {
  return TreeAssembly().run(order, accept_unphysical);
}

}  // namespace porthos::mechanics
