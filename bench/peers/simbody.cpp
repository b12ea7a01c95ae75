// Simbody (Sherman, Seth, Delp 2011). Its caches hang on the state: setting q and u makes them old,
// and realising the stages again is part of each call, as in a step.
#include <algorithm>

#include "bench/peers/subject.h"
#include "bench/simbody.h"

namespace porthos::bench {
namespace {

struct SimbodyRun {
  SimTK::MultibodySystem system;
  SimTK::SimbodyMatterSubsystem matter{system};
  SimTK::GeneralForceSubsystem forces{system};
  SimTK::Force::Gravity gravity;
  SimTK::State state;
  std::vector<SimTK::Vector> q, u, tau, a;
  std::vector<int> at;  ///< of Porthos' freedoms among Simbody's
  SimTK::Vector out;
  SimTK::Vector_<SimTK::SpatialVec> bodies;
  SimTK::Matrix M;

  explicit SimbodyRun(const SimTK::Vec3& g) : gravity(forces, matter, g) {}
  // Its operators of the tree without constraints: realising accelerations would also look for
  // multipliers.
  void aba(int i) {
    const auto s = size_t(i);
    state.updQ() = q[s];
    state.updU() = u[s];
    system.realize(state, SimTK::Stage::Dynamics);
    matter.calcAccelerationIgnoringConstraints(state, tau[s], gravity.getBodyForces(state), out,
                                               bodies);
  }
  void rnea(int i) {
    const auto s = size_t(i);
    state.updQ() = q[s];
    state.updU() = u[s];
    system.realize(state, SimTK::Stage::Velocity);
    matter.calcResidualForceIgnoringConstraints(state, {}, gravity.getBodyForces(state), a[s], out);
  }
  /// Column by column, by its product of the mass matrix and a vector.
  void crba(int i) {
    state.updQ() = q[size_t(i)];
    system.realize(state, SimTK::Stage::Position);
    matter.calcM(state, M);
  }
};

SimTK::Rotation rotation(const Eigen::Matrix3d& R) {
  return SimTK::Rotation(SimTK::Mat33(Eigen::Matrix3d(R.transpose()).data()), true);  // by rows
}

SimTK::MobilizedBody add_body(const mechanics::Mechanism& m, int i, SimTK::MobilizedBody& parent) {
  const PeerBody b = peer_body(m, i);
  const auto& I = b.inertia_at_com;
  const SimTK::Vec3 com(b.com.data()), p(b.r.data());
  const SimTK::Inertia central(I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
  const SimTK::Body::Rigid body(
      SimTK::MassProperties(b.mass, com, central.shiftFromMassCenter(-com, b.mass)));
  const SimTK::Transform placement(rotation(b.R), p);
  if (is_joint(m, i, "free")) return SimTK::MobilizedBody::Free(parent, placement, body, {});
  if (is_joint(m, i, "revolute")) return SimTK::MobilizedBody::Pin(parent, placement, body, {});
  const Eigen::Matrix3d x_to_z{{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};  // its sliders go along x
  return SimTK::MobilizedBody::Slider(parent, {rotation(b.R * x_to_z), p}, body,
                                      {rotation(x_to_z), SimTK::Vec3(0)});
}

}  // namespace

Subject simbody_subject(const Case& c) {
  const mechanics::Mechanism& m = *c.model;
  const Convention convention{.angular_first = true, .world_linear = true, .world_angular = true};
  const auto& g = m.gravity();
  auto r = std::make_shared<SimbodyRun>(SimTK::Vec3(g.x, g.y, g.z));
  std::vector<SimTK::MobilizedBody> body;
  for (int i = 0; i < m.body_count(); ++i) {
    const int parent = m.nodes()[size_t(i)].parent;
    body.push_back(add_body(m, i, parent < 0 ? r->matter.updGround() : body[size_t(parent)]));
  }
  r->state = r->system.realizeTopology();
  r->system.realizeModel(r->state);
  std::vector<int> q_at;
  for (auto& b : body) {
    for (int k = 0; k < b.getNumU(r->state); ++k) r->at.push_back(b.getFirstUIndex(r->state) + k);
    for (int k = 0; k < b.getNumQ(r->state); ++k) q_at.push_back(b.getFirstQIndex(r->state) + k);
  }
  const auto ordered = [](const auto& x, const std::vector<int>& at) {
    SimTK::Vector y(int(at.size()));
    for (size_t k = 0; k < at.size(); ++k) y[at[k]] = x[k];
    return y;
  };
  for (size_t s = 0; s < c.q.size(); ++s) {
    Vec q = c.q[s];  // its quaternion comes first
    if (Convention::free_base(m)) std::rotate(q.begin(), q.begin() + 3, q.begin() + 7);
    r->q.push_back(ordered(q, q_at));
    r->u.push_back(ordered(convention.to_peer(m, c.q[s], c.v[s]), r->at));
    r->tau.push_back(ordered(convention.force_to_peer(m, c.q[s], c.tau[s]), r->at));
    r->a.push_back(ordered(convention.acceleration_to_peer(m, c.q[s], c.v[s], c.tau[s]), r->at));
  }

  Subject s;
  int major, minor, build;
  SimTK_version_simbody(&major, &minor, &build);
  s.name = "Simbody " + std::to_string(major) + "." + std::to_string(minor);
  s.aba = [r](int i) { r->aba(i); };
  s.rnea = [r](int i) { r->rnea(i); };
  s.crba = [r](int i) { r->crba(i); };
  const auto left = [r] {
    Eigen::VectorXd x(r->out.size());
    for (int k = 0; k < x.size(); ++k) x[k] = r->out[r->at[size_t(k)]];
    return x;
  };
  convention.add_checks(s, c, left, left, [r] {
    Eigen::MatrixXd M(r->M.nrow(), r->M.ncol());
    for (int i = 0; i < M.rows(); ++i)
      for (int k = 0; k < M.cols(); ++k) M(i, k) = r->M(r->at[size_t(i)], r->at[size_t(k)]);
    return M;
  });
  return s;
}

}  // namespace porthos::bench
