#include "scene/assemble/outputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mechanics/euler_angles.h"
#include "mechanics/hamiltonian_field.h"
#include "mechanics/joint_list.h"
#include "mechanics/kinematics.h"

namespace porthos::scene {
namespace {

using mechanics::Vec3d;

void put(const Vec3d& v, std::span<double> to) {
  for (int k = 0; k < 3; ++k) to[size_t(k)] = v[k];
}

}  // namespace

Outputs::Outputs(const Scene& scene, const Assembly& assembly, std::vector<Output> outputs)
    : scene_(scene),
      assembly_(assembly),
      outputs_(std::move(outputs)),
      model_(*assembly.model),
      inner_model_(assembly.internal(), model_),
      view_(assembly) {
  std::vector<std::string> names;
  for (const Output& o : outputs_) {
    Item item{};
    item.output = &o;
    bind(item);
    if (o.quantity == OutputQuantity::formula) item.formula.emplace(o.formula, names);
    for (auto& name : component_names(o)) names.push_back(std::move(name));
    items_.push_back(std::move(item));
  }
  size_ = names.size();
  values_.resize(size_);
  if (items_.empty()) return;
  const auto& m = *assembly.mechanism;
  w_.emplace(m);
  poses_.resize(m.nodes().size());
  using Q = OutputQuantity;
  const auto needs = [&](auto... q) {
    return std::any_of(outputs_.begin(), outputs_.end(),
                       [&](const Output& o) { return ((o.quantity == q) || ...); });
  };
  places_ = needs(Q::position, Q::attitude, Q::euler_angles, Q::angle, Q::distance, Q::velocity,
                  Q::angular_velocity, Q::momentum, Q::angular_momentum);
  twists_ =
      needs(Q::velocity, Q::angular_velocity, Q::joint_rate, Q::momentum, Q::angular_momentum);
  if (needs(Q::energy, Q::power)) whole_ = model_.instantiate<double>();
  if (needs(Q::joint_torque, Q::joint_wrench, Q::motor_rate, Q::motor_torque)) {
    inner_ = inner_model_.instantiate<double>();
    field_.resize(size_t(inner_model_.description().nx));
  }
  if (needs(Q::joint_torque)) {
    mechanism_ = assembly.mechanical->instantiate<double>();
    bare_field_.resize(size_t(assembly.mechanical->description().nx));
  }
  if (needs(Q::joint_wrench)) {
    dual_w_.emplace(m);
    dual_poses_.resize(m.nodes().size());
    dual_q_.resize(size_t(m.nq()));
    dual_p_.resize(size_t(m.nq()));
    carried_.resize(m.nodes().size());
    if (!inner_model_.description().constraints.empty()) {
      reactions_.emplace(inner_model_);
      forces_.resize(field_.size());
    }
  }
  const auto& d = assembly.model->description();
  stored_.resize(d.storages.size());
  powers_.resize(d.powers.size());
  efforts_.resize(size_t(d.nx));
  angles_.resize(size_t(d.angle_count()));
}

void Outputs::hold(std::span<const double> values) {
  for (const auto& memory : model_.memories()) {
    if (values.size() < memory->size()) return;  // before the first instant
    std::copy_n(values.begin(), memory->size(), memory->begin());
    values = values.subspan(memory->size());
  }
}

/// Energies and powers, and what changes the momenta.
void Outputs::evaluate_fields(double t, const phs::State& s, std::span<const double> inputs) {
  for (size_t i = 0; i < angles_.size(); ++i)
    angles_[i] = i < s.turns.size() ? double(s.turns[i]) * phs::two_pi_hi : 0;
  if (whole_) {
    whole_->set_turn_angles(angles_);
    whole_->stored(s.x, stored_);
    whole_->gradient(s.x, efforts_);
    whole_->powers(t, s.x, efforts_, powers_);
  }
  if (!inner_) return;
  const auto x = std::span<const double>(s.x);
  inner_->set_turn_angles(angles_);
  inner_->field(t, x.first(field_.size()), inputs, field_);
  if (reactions_) {  // x' = field - Bλ
    reactions_->set_turn_angles(angles_);
    (void)reactions_->along(t, x.first(field_.size()), field_);
    reactions_->forces(forces_);
  }
  if (!mechanism_) return;
  mechanism_->set_turn_angles(angles_);
  mechanism_->field(t, x.first(bare_field_.size()), {}, bare_field_);
}

std::span<const double> Outputs::at(double t, const phs::State& s, std::span<const double> held,
                                    std::span<const double> inputs) {
  if (items_.empty()) return {};
  const auto& m = *assembly_.mechanism;
  const auto nq = size_t(m.nq());
  const phs::State& world = view_(t, s);
  w_->set_turns(world.turns);
  const auto q = std::span<const double>(world.x).first(nq);
  if (twists_)
    mechanics::rates_from_momenta<double>(m, *w_, q,
                                          std::span<const double>(world.x).subspan(nq, nq));
  if (places_) mechanics::forward_kinematics<double>(m, *w_, q, poses_);
  if (whole_ || inner_) {
    hold(held);
    evaluate_fields(t, s, inputs);
  }
  if (contacts_) touches_ = contacts_->at(s);
  size_t to = 0;
  for (Item& item : items_) {
    const auto own = std::span(values_).subspan(to, item.output->size());
    if (item.gone)
      std::fill(own.begin(), own.end(), NAN);
    else if (item.output->of_controller())
      std::copy_n(held.begin() + long(item.told), own.size(), own.begin());
    else
      evaluate(item, item.output->quantity == OutputQuantity::joint_wrench ? s : world, own);
    to += own.size();
  }
  return values_;
}

void Outputs::evaluate(Item& item, const phs::State& s, std::span<double> to) {
  const Output& o = *item.output;
  const auto turn = [&] { return item.turn < 0 ? 0 : double(s.turns[size_t(item.turn)]); };
  switch (o.quantity) {
    case OutputQuantity::position:
    case OutputQuantity::attitude:
    case OutputQuantity::euler_angles:
    case OutputQuantity::angle:
    case OutputQuantity::distance:
      return frame(item, to);
    case OutputQuantity::velocity:
    case OutputQuantity::angular_velocity:
      return motion(item, to);
    case OutputQuantity::joint_position:
      to[0] = s.x[size_t(item.q)] + turn() * phs::two_pi_hi;
      return;
    case OutputQuantity::joint_rate:
      to[0] = w_->rate[size_t(item.v)];
      return;
    case OutputQuantity::joint_torque:
      to[0] = torque(item, s);
      return;
    case OutputQuantity::joint_wrench:
      return wrench(item, s, to);
    case OutputQuantity::centre_of_mass:
      return put(mechanics::centre_of_mass<double>(
                     *assembly_.mechanism, *w_,
                     std::span<const double>(s.x).first(size_t(assembly_.mechanism->nq()))),
                 to);
    case OutputQuantity::momentum:
    case OutputQuantity::angular_momentum:
      return momenta(item, to);
    case OutputQuantity::energy:
      to[0] = stored_[size_t(item.row)];
      return;
    case OutputQuantity::power:
      to[0] = powers_[size_t(item.row)];
      return;
    case OutputQuantity::deflection:
    case OutputQuantity::stiffness_setting:
    case OutputQuantity::stiffness:
    case OutputQuantity::spring_torque:
    case OutputQuantity::motor_rate:
    case OutputQuantity::motor_torque:
      to[0] = of_actuator(item, s);
      return;
    case OutputQuantity::contact_force:
    case OutputQuantity::normal_force:
    case OutputQuantity::overlap:
      return of_contact(item, to);
    case OutputQuantity::altitude:
    case OutputQuantity::semi_major_axis:
    case OutputQuantity::eccentricity:
    case OutputQuantity::inclination:
    case OutputQuantity::node:
      to[0] = of_orbit(item, s);
      return;
    case OutputQuantity::task_error:
    case OutputQuantity::planned_force:
    case OutputQuantity::planned_footstep:
    case OutputQuantity::capture_point:
      return;  // at() copies them
    case OutputQuantity::formula:
      to[0] = (*item.formula)(
          std::span<const double>(values_).first(size_t(to.data() - values_.data())));
  }
}

void Outputs::of_contact(const Item& item, std::span<double> to) const {
  const contact::SoftTouch& touch = touches_[item.contact];
  if (item.output->quantity == OutputQuantity::contact_force) return put(touch.force, to);
  to[0] = item.output->quantity == OutputQuantity::overlap ? touch.depth : touch.pressed;
}

/// The force that changes p by the difference of the fields: the joint momenta are linear in p.
double Outputs::torque(const Item& item, const phs::State& s) const {
  const auto& m = *assembly_.mechanism;
  const auto pushed = [&](int q) {
    const auto p = size_t(m.nq() + q);
    return field_[p] - bare_field_[p];
  };
  if (!item.whole) return pushed(item.q);
  const auto& node = m.nodes()[size_t(item.node)];
  double p[7], mu[6];  // of a free joint
  mechanics::visit_joint(node.type, [&](auto J) {
    for (int k = 0; k < decltype(J)::nq; ++k) p[k] = pushed(node.q + k);
    decltype(J)::momentum(s.x.data() + node.q, p, mu);
  });
  return mu[item.v - node.v];
}

mechanics::Pose Outputs::pose_of(const Place& p) const {
  return p.node < 0 ? p.pose : poses_[size_t(p.node)] * p.pose;
}

/// Angular velocity and velocity of the point, world axes.
mechanics::Motion<double> Outputs::twist_at(const Place& p) const {
  if (p.node < 0) return {{0, 0, 0}, {0, 0, 0}};
  const auto& V = w_->V[size_t(p.node)];
  const auto& R = poses_[size_t(p.node)].R;
  return {R * V.w, R * (V.v + cross(V.w, p.pose.r))};
}

void Outputs::frame(const Item& item, std::span<double> to) const {
  const auto a = pose_of(item.of), b = pose_of(item.seen_from);
  const Output& o = *item.output;
  if (o.quantity == OutputQuantity::position) return put(b.R.tmul(a.r - b.r), to);
  if (o.quantity == OutputQuantity::distance) {
    to[0] = mechanics::norm(a.r - b.r) - o.of.radius - o.seen_from.radius;
    return;
  }
  const auto xi = mechanics::quaternion_of({b.R.tmul(a.R.x), b.R.tmul(a.R.y), b.R.tmul(a.R.z)});
  if (o.quantity == OutputQuantity::angle) {
    to[0] = 2 * std::atan2(std::hypot(xi[1], xi[2], xi[3]), std::fabs(xi[0]));
    return;
  }
  if (o.quantity == OutputQuantity::euler_angles)
    return put(euler_angles(mechanics::Quaternion<double>::load(xi.data()), o.sequence), to);
  for (size_t k = 0; k < 4; ++k) to[k] = xi[0] < 0 ? -xi[k] : xi[k];
}

void Outputs::motion(const Item& item, std::span<double> to) const {
  const auto a = pose_of(item.of), b = pose_of(item.seen_from);
  const auto A = twist_at(item.of), B = twist_at(item.seen_from);
  const auto& axes = item.output->own_axes ? a.R : b.R;
  if (item.output->quantity == OutputQuantity::angular_velocity)
    return put(axes.tmul(A.w - B.w), to);
  put(axes.tmul(A.v - B.v - cross(B.w, a.r - b.r)), to);
}

/// Of some nodes or all; the angular one about their centre of mass c or that of all. About that of
/// all: Σ (r - c) × m (v - c'), of which those of groups have the sum of all.
void Outputs::momenta(const Item& item, std::span<double> to) const {
  struct Sum {
    Vec3d P{0, 0, 0}, L{0, 0, 0}, mc{0, 0, 0};
    double mass = 0;
  } own, all;
  const auto& nodes = assembly_.mechanism->nodes();
  for (size_t i = 0; i < nodes.size(); ++i) {
    const bool is_own = item.nodes.empty() || std::ranges::count(item.nodes, i) > 0;
    if (!is_own && !item.output->about_all) continue;
    const auto& I = nodes[i].inertia;
    const auto h = poses_[i].to_parent(I * w_->V[i]);
    for (Sum* sum : {&own, &all}) {
      if (sum == &own && !is_own) continue;
      sum->P += h.f;
      sum->L += h.n;
      sum->mass += I.m;
      sum->mc += I.m * poses_[i].r + poses_[i].R * I.mc;
    }
  }
  if (item.output->quantity == OutputQuantity::momentum) return put(own.P, to);
  const Sum& about = item.output->about_all ? all : own;
  const Vec3d c = (1 / about.mass) * about.mc, L = own.L - cross(c, own.P);
  if (!item.output->about_all) return put(L, to);
  put(L - cross(own.mc - own.mass * c, (1 / all.mass) * all.P), to);
}

void Outputs::wrench(const Item& item, const phs::State& s, std::span<double> to) {
  const auto& m = *assembly_.mechanism;
  const auto nq = size_t(m.nq());
  for (size_t i = 0; i < nq; ++i) {
    const auto rate = [&](size_t k) { return reactions_ ? field_[k] - forces_[k] : field_[k]; };
    dual_q_[i] = {s.x[i], rate(i)};
    dual_p_[i] = {s.x[nq + i], rate(nq + i)};
  }
  dual_w_->set_turns(s.turns);
  mechanics::rates_from_momenta<Dual>(m, *dual_w_, dual_q_, dual_p_);
  mechanics::forward_kinematics<Dual>(m, *dual_w_, dual_q_, dual_poses_);
  // The momentum of the subtree about the world's origin changes by the wrench and by its weight.
  Vec3d n{0, 0, 0}, f{0, 0, 0};
  const auto& nodes = m.nodes();
  for (size_t i = 0; i < nodes.size(); ++i) {
    const int parent = nodes[i].parent;
    carried_[i] = int(i) == item.node || (parent >= 0 && carried_[size_t(parent)]);
    if (!carried_[i]) continue;
    const auto& I = nodes[i].inertia;
    const auto& X = dual_poses_[i];
    const mechanics::RigidInertia<Dual> J{Dual(I.m), mechanics::Vec3<Dual>(I.mc),
                                          mechanics::Sym3<Dual>(I.I)};
    const auto h = X.to_parent(J * dual_w_->V[i]);
    const auto mc = mechanics::Vec3<Dual>(Dual(I.m) * X.r) + X.R * J.mc;
    const Vec3d at{mc.x.v, mc.y.v, mc.z.v}, weight = I.m * m.gravity();
    n += Vec3d{h.n.x.d, h.n.y.d, h.n.z.d} - cross(at, m.gravity());
    f += Vec3d{h.f.x.d, h.f.y.d, h.f.z.d} - weight;
  }
  if (item.turned) {  // it acts on the other side
    n = -n;
    f = -f;
  }
  const auto& X = dual_poses_[size_t(item.of.node)];
  const auto value = [](const mechanics::Vec3<Dual>& v) { return Vec3d{v.x.v, v.y.v, v.z.v}; };
  const mechanics::Pose node{{value(X.R.x), value(X.R.y), value(X.R.z)}, value(X.r)};
  const auto joint = node * item.of.pose;
  put(joint.R.tmul(n - cross(joint.r, f)), to);
  put(joint.R.tmul(f), to.subspan(3));
}

}  // namespace porthos::scene
