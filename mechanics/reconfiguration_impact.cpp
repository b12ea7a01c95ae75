// The motion of the changed mechanism: the same positions, and the rates nearest to the old ones.
#include <algorithm>
#include <cmath>

#include "mechanics/crba.h"
#include "mechanics/detail/turning.h"
#include "mechanics/rotation.h"
#include "phs/linear_algebra/dense.h"

namespace porthos::mechanics {
namespace {

using Real = Instant::Real;
using Reals = Instant::Reals;

const Vec3<Real>& column(const Mat3<Real>& R, int j) { return j == 0 ? R.x : j == 1 ? R.y : R.z; }

/// Inertia of a body about its frame's origin, in its frame's axes, from the user's input.
RigidInertia<Real> inertia_of(const MassProperties& given) {
  const auto& g = given.inertia;
  const Mat3<Real> E(given.axes);
  const double I[3][3] = {{g.xx, g.xy, g.xz}, {g.xy, g.yy, g.yz}, {g.xz, g.yz, g.zz}};
  Real J[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      J[i][j] = 0;
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l) J[i][j] += column(E, k)[i] * Real(I[k][l]) * column(E, l)[j];
    }
  const Real m = given.mass;
  const Vec3<Real> c{Real(given.com.x), Real(given.com.y), Real(given.com.z)};
  const Real cc = dot(c, c);
  RigidInertia<Real> r;
  r.m = m;
  r.mc = m * c;
  r.I.xx = J[0][0] + m * (cc - c.x * c.x);
  r.I.yy = J[1][1] + m * (cc - c.y * c.y);
  r.I.zz = J[2][2] + m * (cc - c.z * c.z);
  r.I.xy = J[0][1] - m * c.x * c.y;
  r.I.xz = J[0][2] - m * c.x * c.z;
  r.I.yz = J[1][2] - m * c.y * c.z;
  return r;
}

Real power(const Force<Real>& f, const Motion<Real>& v) { return dot(f.n, v.w) + dot(f.f, v.v); }

/// The coordinates of the new mechanism: unchanged for joints that stay, the stored ones for
/// unlocked joints, and the pose for freed bodies.
phs::State positions(const MovingMechanism& before, const Instant& from,
                     const std::vector<BodySpec>& bodies, const MechanicalModel& to) {
  const auto& a = before.model->description();
  const auto& b = to.description();
  phs::State s(b, std::vector<double>(size_t(b.nx)));
  s.take_clock(before.state);
  size_t turn = 0;
  std::map<std::string, size_t> used, turned;  // numbers and turns taken from a locked joint
  for (const auto& c : to.mechanism().coordinates()) {
    size_t old_turn = 0;
    const phs::Block* old = nullptr;
    for (const auto& block : a.blocks) {
      if (block.name == c.name && block.kind == c.kind && block.size == c.nq) old = &block;
      if (!old && block.kind == phs::BlockKind::angle) ++old_turn;
    }
    const bool angle = c.kind == phs::BlockKind::angle;
    const size_t at = size_t(c.q), n = size_t(c.nq);
    if (old) {
      std::copy_n(before.state.x.begin() + old->at, n, s.x.begin() + long(at));
      std::copy_n(before.state.lo.begin() + old->at, n, s.lo.begin() + long(at));
      if (angle) s.turns[turn] = before.state.turns[old_turn];
    } else if (const auto l = before.locked.find(c.joint); l != before.locked.end()) {
      size_t& k = used[c.joint];
      if (angle) s.turns[turn] = l->second.turns.at(turned[c.joint]++);
      std::copy_n(l->second.q.begin() + long(k), n, s.x.begin() + long(at));
      std::copy_n(l->second.lo.begin() + long(k), n, s.lo.begin() + long(at));
      k += n;
    } else {  // a body that became free
      const auto body = std::find_if(bodies.begin(), bodies.end(), [&](const BodySpec& x) {
        return x.joint.type == "free" && joint_of(x) == c.joint;
      });
      if (body == bodies.end())
        throw InvalidArgument("reconfiguration: the coordinate '" + c.name +
                              "' has no value, expected a joint that stays, or a freed body");
      const auto pose = from.pose(body->name);
      const auto xi = quaternion(pose.R);
      const Real numbers[7] = {pose.r.x, pose.r.y, pose.r.z, xi.w, xi.v.x, xi.v.y, xi.v.z};
      const Real* values = c.kind == phs::BlockKind::rotation ? numbers + 3 : numbers;
      for (size_t k = 0; k < n; ++k) {
        s.x[at + k] = double(values[k]);
        s.lo[at + k] = double(values[k] - Real(s.x[at + k]));
      }
    }
    if (angle) ++turn;
  }
  return s;
}

/// The impulse that ends what the loops do not allow: p⁺ = p - B λ with D λ = Bᵀv + ∂g/∂t. Of two
/// nearest rates in turn, with and without loops, the second is the nearest of all.
/// @return the energy that moving rows put in, λᵀ ∂g/∂t
Real keep_loops(const MechanicalModel& model, double time, Instant& to) {
  const auto system = model.instantiate<Real>();
  const auto rows = system->constraints();
  if (!rows) return 0;
  Reals x(to.q), e(2 * to.q.size()), lambda(size_t(rows->count())), push(e.size());
  x.insert(x.end(), to.p.begin(), to.p.end());
  Reals drift(lambda.size(), Real(0));
  rows->set_time(time);
  rows->place(x, lambda);
  rows->add_drift(drift);
  rows->factor(x);
  system->gradient(x, e);
  rows->rates(e, lambda);
  rows->add_drift(lambda);
  rows->solve(lambda);
  rows->forces(lambda, push);
  for (size_t i = 0; i < to.p.size(); ++i) to.p[i] -= push[to.q.size() + i];
  rates_from_momenta<Real>(to.m, to.w, to.q, to.p);
  to.v = to.w.rate;
  momenta_from_rates<Real>(to.m, to.w, to.q, to.v, to.p);
  Real put_in = 0;
  for (size_t r = 0; r < drift.size(); ++r) put_in += lambda[r] * drift[r];
  return put_in;
}

/// Bodies that move something: frames without mass may be new.
std::vector<BodySpec> with_mass(std::vector<BodySpec> bodies) {
  std::erase_if(bodies, [](const BodySpec& b) {
    const auto& i = b.mass.inertia;
    return b.mass.mass == 0 && i.xx == 0 && i.yy == 0 && i.zz == 0;
  });
  return bodies;
}

/// Computes the rates nearest to the old motion, see the header.
Impact impact(const Instant& from, const std::vector<BodySpec>& bodies,
              const MechanicalModel& model, double time, phs::State& s) {
  Instant to(model, s);
  const size_t nv = to.v.size(), nq = to.q.size();
  Reals h(nv, Real(0)), M(nv * nv), J(6 * nv);
  for (const auto& b : bodies) {
    const auto& frame = to.m.body(b.name);
    if (frame.node < 0) continue;
    const Force<Real> momentum = inertia_of(b.mass) * from.twist(b.name);
    jacobian<Real>(to.m, to.w, to.q, frame, JacobianAxes::body, J);
    for (size_t k = 0; k < nv; ++k)
      for (int i = 0; i < 6; ++i) h[k] += J[6 * k + size_t(i)] * momentum[i];
  }
  const auto rotor_rate = [&](const Instant& at, const std::string& joint) {
    for (const auto& j : at.m.joint_properties())
      if (j.joint == joint) return at.v[size_t(j.v)];
    return Real(0);
  };
  for (const auto& j : to.m.joint_properties())
    if (j.rotor_inertia > 0) h[size_t(j.v)] += Real(j.rotor_inertia) * rotor_rate(from, j.joint);
  crba<Real>(to.m, to.w, to.q, M);
  phs::dense::cholesky(nv, M.data(), M.data());
  phs::dense::solve(nv, M.data(), h.data(), h.data());
  to.v = h;
  momenta_from_rates<Real>(to.m, to.w, to.q, to.v, to.p);
  Impact r;
  r.driven_J = double(keep_loops(model, time, to));
  for (size_t i = 0; i < nq; ++i) {
    s.x[nq + i] = double(to.p[i]);
    s.lo[nq + i] = double(to.p[i] - Real(s.x[nq + i]));
  }

  Real lost = 0;
  for (const auto& b : bodies) {
    const auto before = from.twist(b.name), after = to.twist(b.name);
    const auto change = after - before;
    lost += power(inertia_of(b.mass) * change, change) / 2;
    for (int i = 0; i < 6; ++i) r.rate_jump = std::max(r.rate_jump, std::fabs(double(change[i])));
  }
  for (const auto& j : from.m.joint_properties()) {
    const Real change = rotor_rate(to, j.joint) - from.v[size_t(j.v)];
    lost += Real(j.rotor_inertia) * change * change / 2;
  }
  r.dissipated_J = double(lost);
  return r;
}

void measure(Impact& r, Instant& from, const MechanicalModel& model, const phs::State& s) {
  Instant to(model, s);
  const auto a = momentum<Real>(from.m, from.w, from.q, from.p),
             b = momentum<Real>(to.m, to.w, to.q, to.p);
  r.momentum = {lowered(a.linear), lowered(a.angular)};
  Workspace<double> w(from.m);
  std::vector<double> q, v;
  for (const Real& x : from.q) q.push_back(double(x));
  for (const Real& x : from.v) v.push_back(double(x));
  r.scale = momentum_scale(from.m, w, q, v);
  // A rigid body that spins about its centre has Σ m|v| = 0, although its points have momenta.
  double mass = 0;
  for (const auto& n : from.m.nodes()) mass += n.inertia.m;
  const Real T = kinetic_energy<Real>(from.m, from.w, from.q, from.p);
  r.scale.linear = std::max(r.scale.linear, std::sqrt(2 * mass * double(T)));
  r.linear_jump = length(b.linear - a.linear);
  r.angular_jump = length(b.angular - a.angular);
}

}  // namespace

Impact change(MovingMechanism& moving, MechanismBuilder next, ConstraintSpec loops,
              LockedJoints locked) {
  auto model = std::make_shared<const MechanicalModel>(
      std::make_shared<const Mechanism>(next.build()), std::vector<BodyPort>(),
      without_locked(loops, locked));
  Instant from(*moving.model, moving.state);
  phs::State s = positions(moving, from, next.bodies(), *model);
  Impact r = impact(from, with_mass(next.bodies()), *model, moving.time, s);
  phs::wrap_angles(model->description(), s);
  measure(r, from, *model, s);
  moving.parts = std::move(next);
  moving.constraints = std::move(loops);
  moving.model = std::move(model);
  moving.state = std::move(s);
  moving.locked = std::move(locked);
  return r;
}

}  // namespace porthos::mechanics
