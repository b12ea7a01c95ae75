#include "mechanics/builder.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "mechanics/hamiltonian_field-inl.h"

namespace porthos::mechanics {
namespace {

std::string at(const std::string& where) { return where.empty() ? "" : where + ": "; }

[[noreturn]] void refuse(const BodySpec& b, const std::string& text) {
  throw InvalidArgument(at(b.where) + "body '" + b.name + "': " + text);
}
[[noreturn]] void refuse_joint(const BodySpec& b, const std::string& text) {
  throw InvalidArgument(at(b.joint.where.empty() ? b.where : b.joint.where) + "joint '" +
                        (b.joint.name.empty() ? b.name : b.joint.name) + "': " + text);
}

/// Principal moments, ascending.
Eigen::Vector3d eigenvalues(const Sym3<double>& S) {
  Eigen::Matrix3d m;
  m << S.xx, S.xy, S.xz, S.xy, S.yy, S.yz, S.xz, S.yz, S.zz;
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(m, Eigen::EigenvaluesOnly).eigenvalues();
}

/// Real files hold rounded digits: a triangle inequality broken by less than this is rounding.
constexpr double triangle_slack = 1e-6;

/// And a body is a point whose radius of gyration is below this: its moments are rounding, of
/// either sign.
constexpr double point_radius = 1e-7;    // m
constexpr double point_inertia = 1e-18;  // kg m^2, of a body whose mass is rounding too

/// By how much principal moments may be wrong by rounding.
double inertia_slack(double mass, double largest) {
  return std::max({triangle_slack * largest, point_radius * point_radius * mass, point_inertia});
}

/// What is wrong with an inertia about the centre of mass, or "".
std::string inertia_fault(double mass, const Sym3<double>& inertia) {
  const auto e = eigenvalues(inertia);
  const double slack = inertia_slack(mass, e[2]);
  if (e[0] < -slack)
    return "inertia is not positive: its smallest principal moment is " + number(e[0]) + " kg m^2";
  if (e[0] + e[1] < e[2] - slack)
    return "inertia breaks the triangle inequality: principal moments " + number(e[0]) + ", " +
           number(e[1]) + ", " + number(e[2]) +
           " kg m^2, expected the largest <= the sum of the other two";
  if (mass == 0 && e[2] > slack) return "has inertia but no mass";
  return "";
}

/// Principal moments below zero by rounding become zero. @return the smallest of them, 0: there was
/// none
double lift_to_zero(MassProperties& m) {
  Sym3<double>& S = m.inertia;
  Eigen::Matrix3d full;
  full << S.xx, S.xy, S.xz, S.xy, S.yy, S.yz, S.xz, S.yz, S.zz;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(full);
  const Eigen::Vector3d& e = solver.eigenvalues();
  if (!(e[0] < 0) || e[0] < -inertia_slack(m.mass, e[2])) return 0;
  const Eigen::Matrix3d& V = solver.eigenvectors();
  full = V * e.cwiseMax(0).asDiagonal() * V.transpose();
  S = {full(0, 0), full(0, 1), full(0, 2), full(1, 1), full(1, 2), full(2, 2)};
  return e[0];
}

/// Orthonormal and right-handed to the digits files are written with.
bool is_rotation(const Mat3<double>& R) {
  const auto near = [](double a, double b) { return std::fabs(a - b) < 1e-6; };
  return near(dot(R.x, R.x), 1) && near(dot(R.y, R.y), 1) && near(dot(R.z, R.z), 1) &&
         near(dot(R.x, R.y), 0) && near(dot(cross(R.x, R.y), R.z), 1);
}

void check_numbers(const BodySpec& b) {
  const MassProperties& m = b.mass;
  if (!std::isfinite(m.mass) || m.mass < 0)
    refuse(b, "mass is " + number(m.mass) + " kg, expected a number >= 0");
  if (!finite(m.com)) refuse(b, "centre of mass is not finite");
  if (!is_rotation(m.axes)) refuse(b, "inertia axes are not a rotation");
  if (!finite(b.placement.r) || !is_rotation(b.placement.R))
    refuse_joint(b, "placement is not a finite pose");
  const auto& I = m.inertia;
  if (!std::isfinite(I.xx + I.xy + I.xz + I.yy + I.yz + I.zz)) refuse(b, "inertia is not finite");
}

/// A rotation whose z axis is `axis`; exact for axes along x, y, z.
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

Pose inverse(const Pose& p) { return {p.R.transposed(), -p.R.tmul(p.r)}; }

/// The rigid inertia of a body seen from the frame in which the body's own frame stands at `pose`.
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

/// Parents before children; each child right after its parent's earlier branches (depth first, in
/// the order added).
std::vector<const BodySpec*> depth_first(const std::vector<BodySpec>& bodies) {
  std::map<std::string, const BodySpec*> by_name;
  std::map<std::string, std::vector<const BodySpec*>> children;
  std::set<std::string> joints;
  for (const auto& b : bodies) {
    if (b.name.empty()) throw InvalidArgument(at(b.where) + "a body has no name");
    if (b.name == "world") refuse(b, "the name 'world' is taken by the inertial frame");
    if (!by_name.emplace(b.name, &b).second) refuse(b, "there is already a body of this name");
    if (b.name == "." || b.joint.name == ".")
      refuse(b, "it or its joint is called '.', which no dataset of a results file can be");
    if (!joints.insert(b.joint.name.empty() ? b.name : b.joint.name).second)
      refuse_joint(b, "there is already a joint of this name");
  }
  for (const auto& b : bodies) {
    if (b.parent != "world" && !by_name.count(b.parent))
      refuse(b, "its parent '" + b.parent + "' does not exist");
    children[b.parent].push_back(&b);
  }
  std::vector<const BodySpec*> order, stack(children["world"].rbegin(), children["world"].rend());
  while (!stack.empty()) {
    const BodySpec* b = stack.back();
    stack.pop_back();
    order.push_back(b);
    const auto& c = children[b->name];
    stack.insert(stack.end(), c.rbegin(), c.rend());
  }
  if (order.size() < bodies.size()) {  // whoever was not reached hangs on a cycle
    std::set<const BodySpec*> reached(order.begin(), order.end());
    for (const auto& b : bodies)
      if (!reached.count(&b))
        refuse(b, "is part of a cycle of joints that never reaches the world");
  }
  return order;
}

/// A primitive of the list by its name; -1 if there is none.
int primitive_index(std::string_view name) {
  int index = -1, i = 0;
  for_each_joint(PrimitiveJoints{}, [&](auto J) {
    if (decltype(J)::name == name) index = i;
    ++i;
  });
  return index;
}

}  // namespace

Mat3<double> rotation_from_rpy(double roll, double pitch, double yaw) {
  using E = long double;
  E sr, cr, sp, cp, sy, cy;
  sincos(E(roll), sr, cr);
  sincos(E(pitch), sp, cp);
  sincos(E(yaw), sy, cy);
  // A right angle written with 15 or more digits is meant to be exact.
  for (E* t : {&sr, &cr, &sp, &cp, &sy, &cy})
    if (std::fabs(double(*t)) < 1e-14) *t = 0;
  return Mat3<double>(Mat3<E>{{cy * cp, sy * cp, -sp},
                              {cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr},
                              {cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr}});
}

MechanismBuilder& MechanismBuilder::add(BodySpec body) {
  bodies_.push_back(std::move(body));
  return *this;
}
MechanismBuilder& MechanismBuilder::accept_unphysical_inertia(bool accept) {
  accept_unphysical_ = accept;
  return *this;
}
MechanismBuilder& MechanismBuilder::gravity(const Vec3d& g) {
  gravity_ = g;
  return *this;
}

namespace {

/// Builds the node tree body by body; frames maps each body to its node and pose there.
class Assembly {
 public:
  struct Result {
    std::vector<Node> nodes;
    std::vector<JointCoordinates> coordinates;
    std::vector<BodyFrame> bodies;
    std::vector<JointProperties> properties;
    std::vector<Remark> remarks;
    int nq = 0, nv = 0, angles = 0;
  };

  Result run(const std::vector<const BodySpec*>& order, bool accept_unphysical) {
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
    if (!known) {
      std::string list;
      for (const auto& n : joint_type_names()) list += (list.empty() ? "" : ", ") + n;
      refuse_joint(b, "unknown type '" + b.joint.type + "', expected one of " + list);
    }
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

  /// Only the inertia of a whole moving body enters the dynamics: a faulty link merged into a sound
  /// body is a remark, a faulty moving body an error that names the link to mend.
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
      const bool positive = whole.m > 0 && eigenvalues(total)[0] > 0;
      if (!(accept_unphysical ? positive : inertia_fault(whole.m, total).empty()))
        refuse(*b, inertia_fault(b->mass.mass, b->mass.inertia));
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

  /// One primitive joint after the frame here_ of node_; afterwards node_ is the new node and here_
  /// the user's frame in it.
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
                     j.rotor_inertia != 0;
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
      refuse_joint(b, "a rotor inertia needs a joint of one freedom, '" + j.type + "' has " +
                          std::to_string(freedoms));
    if (!std::isfinite(j.rest)) refuse_joint(b, "rest is not finite");
    if (j.lower && j.upper && !(*j.lower <= *j.upper))
      refuse_joint(
          b, "lower limit " + number(*j.lower) + " is above the upper one, " + number(*j.upper));
    if (!has || freedoms == 0) return;
    const Node& n = r_.nodes.back();
    if (freedoms != 1) {
      if (j.damping != 0 || j.stiffness != 0)
        refuse_joint(
            b, "damping and stiffness need a joint of one freedom, '" + j.type + "' has several");
      return;
    }
    r_.properties.push_back({j.name.empty() ? b.name : j.name, n.q, n.v, n.turn, j.damping,
                             j.stiffness, j.rest, j.friction, j.lower, j.upper, j.rotor_inertia});
  }

  Result r_;
  std::map<std::string, size_t> frames_;
  std::set<std::string> coordinate_names_;
  const BodySpec* body_ = nullptr;
  int node_ = -1;
  Pose here_{};
};

/// Whether the joint carries the node.
bool carried_by(const Mechanism& m, int node, const std::string& joint) {
  for (; node >= 0; node = m.nodes()[size_t(node)].parent)
    for (const auto& c : m.coordinates())
      if (c.node == node && c.joint == joint) return true;
  return false;
}

/// Every freedom must move some inertia: not at each configuration (a wrist may be singular at
/// zero), but at one of those tried.
void check_moving_inertia(const Mechanism& m) {
  std::vector<double> q = m.neutral();
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> angle(-3, 3);
  std::optional<std::string> joint;
  for (int sample = 0; sample < 3; ++sample) {
    joint = joint_without_inertia(m, q);
    if (!joint) return;
    for (const auto& c : m.coordinates())
      if (c.kind == phs::BlockKind::angle) q[size_t(c.q)] = angle(rng);
  }
  std::vector<std::string> links;
  for (const auto& b : m.bodies())
    if (b.node >= 0 && m.nodes()[size_t(b.node)].inertia.m == 0 && carried_by(m, b.node, *joint))
      links.push_back(b.name);
  throw MasslessPart("joint '" + *joint +
                         "' moves no inertia: the bodies beyond it are massless about it, expected "
                         "mass properties for them or the joint locked",
                     *joint, std::move(links));
}

}  // namespace

std::optional<std::string> joint_without_inertia(const Mechanism& m, std::span<const double> q) {
  Workspace<double> w(m);
  const std::vector<double> p(q.size(), 0.0);
  passes::sines(m, w, q.data());
  field_detail::factor(m, w, q.data(), p.data(), false);
  // Leaf to root: a pivot of zero spoils what is above it.
  for (auto c = m.coordinates().rbegin(); c != m.coordinates().rend(); ++c)
    for (int k = 0; k < c->nv; ++k) {
      const double D_inverse = w.D_inverse[size_t(c->v + k)];
      const double scale = norm(w.U[size_t(c->v + k)].n) + norm(w.U[size_t(c->v + k)].f);
      // What is left after an elimination that should give zero is rounding, 1e-16 of what was
      // there.
      if (!(D_inverse > 0) || !std::isfinite(D_inverse) || 1 / D_inverse < 1e-13 * scale ||
          1 / D_inverse < 1e-250)
        return c->joint;
    }
  return {};
}

Mechanism MechanismBuilder::build() const {
  if (!finite(gravity_)) throw InvalidArgument("gravity is not finite");
  const auto order = depth_first(bodies_);
  if (order.empty()) throw InvalidArgument("mechanism '" + name_ + "' has no bodies");
  auto parts = Assembly().run(order, accept_unphysical_);

  Mechanism m;
  m.name_ = name_;
  m.nodes_ = std::move(parts.nodes);
  m.coordinates_ = std::move(parts.coordinates);
  m.bodies_ = std::move(parts.bodies);
  m.properties_ = std::move(parts.properties);
  m.remarks_ = std::move(parts.remarks);
  m.gravity_ = gravity_;
  m.nq_ = parts.nq;
  m.nv_ = parts.nv;
  m.angles_ = parts.angles;
  for (const auto& n : m.nodes_) m.total_mass_ += n.inertia.m;
  for (size_t i = m.nodes_.size(); i-- > 0;) {
    Node& n = m.nodes_[i];
    if (n.parent < 0) continue;
    Node& parent = m.nodes_[size_t(n.parent)];
    n.last_child = parent.leaf;
    parent.leaf = false;
  }
  if (m.nodes_.empty())
    throw InvalidArgument("mechanism '" + name_ + "' has no moving bodies: every joint is fixed");
  check_moving_inertia(m);
  // With a rotor at every joint: nothing for gravity to pull, and no centre of mass.
  if (m.total_mass_ == 0)
    throw InvalidArgument("mechanism '" + name_ + "' has no mass: every moving body is massless");
  return m;
}

namespace {
template <class Items, class Name>
auto& find_named(const Items& items, std::string_view name, const char* what, Name get) {
  std::string known;
  for (const auto& i : items) {
    if (get(i) == name) return i;
    known += (known.empty() ? "" : ", ") + get(i);
  }
  throw InvalidArgument("there is no " + std::string(what) + " '" + std::string(name) +
                        "'; known: " + known);
}
}  // namespace

const JointCoordinates& Mechanism::coordinate(std::string_view name) const {
  return find_named(coordinates_, name, "joint coordinate", [](const auto& c) { return c.name; });
}
const BodyFrame& Mechanism::body(std::string_view name) const {
  return find_named(bodies_, name, "body", [](const auto& b) { return b.name; });
}

std::vector<double> Mechanism::neutral() const {
  std::vector<double> q(size_t(nq_), 0.0);
  for (const auto& c : coordinates_)
    if (c.kind == phs::BlockKind::rotation) q[size_t(c.q)] = 1;
  return q;
}

}  // namespace porthos::mechanics
