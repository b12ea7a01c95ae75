#include "scene/assemble/centre_of_mass.h"

#include "mechanics/rotation.h"
#include "scene/assemble/assembly.h"

namespace porthos::scene {
namespace {

using mechanics::Mat3;
using mechanics::Mechanism;
using mechanics::Node;
using WideReal = CentreOfMass::Real;
using WideVec = CentreOfMass::Vec;

constexpr size_t place_of_free = 0, attitude_of_free = 3;  // in q of a free joint
constexpr size_t linear_of_free = 3;                       // in its v, in the body's axes

template <class F>
void each_root(const Mechanism& m, F f) {
  for (const Node& n : m.nodes())
    if (n.parent < 0) f(n);
}

/// A vector of the world in the axes of the root's body.
WideVec in_body(const Node& root, std::span<const WideReal> q, const WideVec& a) {
  const auto xi = mechanics::Quaternion<WideReal>::load(&q[size_t(root.q) + attitude_of_free]);
  return mechanics::rotation_matrix(xi).tmul(Mat3<WideReal>(root.placement.R).tmul(a));
}

}  // namespace

mechanics::Momentum<double> CentreOfMass::in_world(double t,
                                                   const mechanics::Momentum<double>& m) const {
  const Vec P = Vec(m.linear) + Real(mass) * velocity(t);
  const Vec L = Vec(m.angular) + cross(position(t), P);
  return {mechanics::Vec3d(P), mechanics::Vec3d(L)};
}

std::string why_centre_stays(const Scene& s) {
  if (s.centre_stays) return "its motion is asked for";
  if (s.orbit) return "it is in orbit, where the split of orbit and internal motion takes it out";
  if (s.urdf.base != mechanics::UrdfOptions::Base::free) return "the base is fixed";
  for (const Robot& r : s.robots)
    if (!r.free) return "robot '" + r.name + "' is fixed to the world";
  if (s.constraints.on_the_world())
    return "loop '" + s.constraints.held_to_the_world() + "' holds it to the world";
  for (const SceneContact& c : s.contacts)
    for (const auto& link : c.against)
      if (link == "world") return "contact '" + c.name + "' touches the world";
  for (const Element& e : s.elements)
    if (e.pushes())
      return e.type + " '" + e.name + "' pushes from outside";
    else if (e.latch && e.latch->body == "world")
      return e.type + " '" + e.name + "' holds it to the world";
  return "";
}

bool linear_momentum_is_structure(const Assembly& a) {
  if (!a.centre) return false;
  int roots = 0;
  each_root(*a.mechanism, [&](const Node&) { ++roots; });
  return roots == 1;
}

CentreOfMass take_centre_out(const Mechanism& m, std::span<double> q, std::span<double> v) {
  mechanics::Workspace<WideReal> w(m);
  const std::vector<WideReal> q_wide(q.begin(), q.end()), v_wide(v.begin(), v.end());
  std::vector<WideReal> p(q.size());
  mechanics::momenta_from_rates<WideReal>(m, w, q_wide, v_wide, p);
  const WideVec P = mechanics::momentum<WideReal>(m, w, q_wide, p).linear;
  const WideVec c = mechanics::centre_of_mass<WideReal>(m, w, q_wide);
  CentreOfMass taken;
  taken.mass = m.total_mass();
  taken.start_velocity = (1 / WideReal(taken.mass)) * P;
  bool first = true;
  each_root(m, [&](const Node& n) {
    const size_t at = size_t(n.q) + place_of_free, rate = size_t(n.v) + linear_of_free;
    const Mat3<WideReal> axes(n.placement.R);
    const WideVec shift = axes.tmul(c), back = in_body(n, q_wide, taken.start_velocity);
    WideVec moved;
    for (size_t k = 0; k < 3; ++k) {
      q[at + k] = double(q_wide[at + k] - shift[int(k)]);
      v[rate + k] = double(v_wide[rate + k] - back[int(k)]);
      moved[int(k)] = q_wide[at + k] - q[at + k];
    }
    if (first) taken.start = axes * moved;  // moved as the first root: restored exactly
    first = false;
  });
  return taken;
}

void settle_momentum(const Mechanism& m, phs::State& s) {
  const size_t nq = size_t(m.nq());
  const Node* first = nullptr;
  WideVec others{0, 0, 0};  // world axes
  each_root(m, [&](const Node& n) {
    if (!first) {
      first = &n;
      return;
    }
    const size_t at = nq + size_t(n.q) + place_of_free;
    WideVec P;
    for (size_t k = 0; k < 3; ++k) P[int(k)] = WideReal(s.x[at + k]) + s.lo[at + k];
    others += Mat3<WideReal>(n.placement.R) * P;
  });
  const WideVec rest = Mat3<WideReal>(first->placement.R).tmul(others);
  const size_t at = nq + size_t(first->q) + place_of_free;
  for (size_t k = 0; k < 3; ++k) {
    const WideReal P = 0 - rest[int(k)];
    s.x[at + k] = double(P);
    s.lo[at + k] = double(P - s.x[at + k]);
  }
}

WorldView::WorldView(const Assembly& a) : mechanism_(a.mechanism), centre_(a.centre) {
  if (!centre_) return;
  workspace_.emplace(*mechanism_);
  q_.resize(size_t(mechanism_->nq()));
  p_.resize(q_.size());
  v_.resize(size_t(mechanism_->nv()));
}

const phs::State& WorldView::operator()(double t, const phs::State& s) {
  if (!centre_) return s;
  constexpr WideReal two_pi = 6.283185307179586476925286766559005768394L;
  const size_t nq = q_.size();
  for (size_t i = 0; i < nq; ++i) q_[i] = WideReal(s.x[i]) + s.lo[i];
  auto& turns = workspace_->turn_angle;
  for (size_t i = 0; i < turns.size(); ++i) turns[i] = two_pi * WideReal(s.turns[i]);
  const WideVec R = centre_->position(t), V = centre_->velocity(t);
  each_root(*mechanism_, [&](const Node& n) {
    const WideVec own = in_body(n, q_, V);
    for (size_t k = 0; k < 3; ++k) v_[size_t(n.v) + linear_of_free + k] = own[int(k)];
  });
  // Momenta are linear in the rates; these are the momenta that V adds.
  mechanics::momenta_from_rates<WideReal>(*mechanism_, *workspace_, q_, v_, p_);
  world_ = s;
  const auto add = [&](size_t i, WideReal more) {
    const WideReal sum = (WideReal(s.x[i]) + s.lo[i]) + more;
    world_.x[i] = double(sum);
    world_.lo[i] = double(sum - world_.x[i]);
  };
  for (size_t i = 0; i < nq; ++i) add(nq + i, p_[i]);
  each_root(*mechanism_, [&](const Node& n) {
    const WideVec r = Mat3<WideReal>(n.placement.R).tmul(R);
    for (size_t k = 0; k < 3; ++k) add(size_t(n.q) + place_of_free + k, r[int(k)]);
  });
  return world_;
}

}  // namespace porthos::scene
