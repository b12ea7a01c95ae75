#include "mechanics/builder.h"

#include <cmath>
#include <map>
#include <random>
#include <set>

#include "mechanics/detail/body_checks.h"
#include "mechanics/detail/link_frames.h"
#include "mechanics/detail/tree_assembly.h"
#include "mechanics/hamiltonian_field-inl.h"

namespace porthos::mechanics {
namespace {

/// Parents before children, depth first in the order added: each child follows its parent's earlier
/// branches.
std::vector<const BodySpec*> depth_first(const std::vector<BodySpec>& bodies) {
  std::map<std::string, const BodySpec*> by_name;
  std::map<std::string, std::vector<const BodySpec*>> children;
  std::set<std::string> joints;
  for (const auto& b : bodies) {
    if (b.name.empty()) throw InvalidArgument(in_file(b.where) + "a body has no name");
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
  if (order.size() < bodies.size()) {  // unreached bodies hang on a cycle
    std::set<const BodySpec*> reached(order.begin(), order.end());
    for (const auto& b : bodies)
      if (!reached.count(&b))
        refuse(b, "is part of a cycle of joints that never reaches the world");
  }
  return order;
}

void add_mass(Node& n, double mass, double low) {
  const phs::Quad sum = phs::Quad(n.subtree_mass) + n.subtree_mass_low + mass + low;
  n.subtree_mass = double(sum);
  n.subtree_mass_low = double(sum - n.subtree_mass);
}

/// Whether the joint carries the node, directly or through other joints.
bool carried_by(const Mechanism& m, int node, const std::string& joint) {
  for (; node >= 0; node = m.nodes()[size_t(node)].parent)
    for (const auto& c : m.coordinates())
      if (c.node == node && c.joint == joint) return true;
  return false;
}

/// Every freedom must move some inertia at one of the configurations tried. It need not do so at
/// each of them: a wrist may be singular at zero.
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

Mat3<double> rotation_from_rpy(double roll, double pitch, double yaw) {
  using E = long double;
  E sr, cr, sp, cp, sy, cy;
  sincos(E(roll), sr, cr);
  sincos(E(pitch), sp, cp);
  sincos(E(yaw), sy, cy);
  // Right angles written with 15 or more digits are meant to be exact.
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

std::optional<std::string> joint_without_inertia(const Mechanism& m, std::span<const double> q) {
  Workspace<double> w(m);
  const std::vector<double> p(q.size(), 0.0);
  passes::sines(m, w, q.data());
  field_detail::factor(m, w, q.data(), p.data(), field_detail::Load::none);
  // Leaf to root: a zero pivot makes everything above it invalid.
  for (auto c = m.coordinates().rbegin(); c != m.coordinates().rend(); ++c)
    for (int k = 0; k < c->nv; ++k) {
      const double D_inverse = w.D_inverse[size_t(c->v + k)];
      const double gain = norm(w.K[size_t(c->v + k)].n) + norm(w.K[size_t(c->v + k)].f);
      // If an elimination should give zero, what remains is rounding, 1e-16 of the initial value.
      if (!(D_inverse > 0) || !std::isfinite(D_inverse) || !(1e-13 * gain < 1) ||
          1 / D_inverse < 1e-250)
        return c->joint;
    }
  return {};
}

Mechanism MechanismBuilder::build() const {
  if (!finite(gravity_)) throw InvalidArgument("gravity is not finite");
  const auto order = depth_first(bodies_);
  if (order.empty()) throw InvalidArgument("mechanism '" + name_ + "' has no bodies");
  auto parts = assemble_tree(order, accept_unphysical_);
  choose_link_frames(parts.nodes, parts.bodies);

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
    add_mass(n, n.inertia.m, 0);
    if (n.parent < 0) continue;
    Node& parent = m.nodes_[size_t(n.parent)];
    add_mass(parent, n.subtree_mass, n.subtree_mass_low);
    n.last_child = parent.leaf;
    parent.leaf = false;
  }
  if (m.nodes_.empty())
    throw InvalidArgument("mechanism '" + name_ + "' has no moving bodies: every joint is fixed");
  check_moving_inertia(m);
  // With a rotor at every joint the mass can be zero: gravity has no effect, and there is no centre
  // of mass.
  if (m.total_mass_ == 0)
    throw InvalidArgument("mechanism '" + name_ + "' has no mass: every moving body is massless");
  return m;
}

}  // namespace porthos::mechanics
