// Bullet's btMultiBody (after Mirtich 1996), in double precision. It has forward dynamics only:
// Debian leaves out Bullet's inverse dynamics. A link's frame is at its centre of mass and along
// its principal axes.
#include <BulletDynamics/Featherstone/btMultiBody.h>

#include <Eigen/Eigenvalues>

#include "bench/peers/subject.h"

namespace porthos::bench {
namespace {

btVector3 bullet(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
btQuaternion bullet(const Eigen::Quaterniond& q) { return {q.x(), q.y(), q.z(), q.w()}; }

/// What a step would set. Bullet knows no gravity below its world: the world adds a force to every
/// link, as here.
struct BulletState {
  btVector3 position, omega, velocity, torque, force;
  btQuaternion world_to_base;
  std::vector<double> q, v, tau;
};

struct BulletRun {
  std::unique_ptr<btMultiBody> body;
  std::vector<btVector3> weight;
  std::vector<BulletState> states;
  btAlignedObjectArray<btScalar> numbers;
  btAlignedObjectArray<btVector3> vectors;
  btAlignedObjectArray<btMatrix3x3> matrices;

  void aba(int i) {
    const BulletState& s = states[size_t(i)];
    body->clearForcesAndTorques();
    if (!body->hasFixedBase()) {
      body->setBasePos(s.position);
      body->setWorldToBaseRot(s.world_to_base);
      body->setBaseOmega(s.omega);
      body->setBaseVel(s.velocity);
      body->addBaseForce(s.force);
      body->addBaseTorque(s.torque);
    }
    for (int k = 0; k < body->getNumLinks(); ++k) {
      const auto n = size_t(k);
      body->setJointPosMultiDof(k, &s.q[n]);
      body->setJointVelMultiDof(k, &s.v[n]);
      body->addJointTorque(k, s.tau[n]);
      body->addLinkForce(k, weight[n]);
    }
    // A step of zero: the accelerations stay in `numbers` and the velocities as they are.
    body->computeAccelerationsArticulatedBodyAlgorithmMultiDof(0, numbers, vectors, matrices, false,
                                                               false, false);
  }
  Eigen::VectorXd accelerations() const {
    const int joints = body->getNumDofs(), base = body->hasFixedBase() ? 0 : 6;
    return Eigen::Map<const Eigen::VectorXd>(&numbers[joints + 6 - base], base + joints);
  }
};

/// Axes along which the inertia is diagonal, as columns in the body's axes.
Eigen::Matrix3d principal_axes(const PeerBody& b, Eigen::Vector3d& moments) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(b.inertia_at_com);
  moments = solver.eigenvalues();
  Eigen::Matrix3d P = solver.eigenvectors();
  if (P.determinant() < 0) P.col(0) *= -1;
  return P;
}

}  // namespace

Subject bullet_subject(const Case& c) {
  const mechanics::Mechanism& m = *c.model;
  const bool free = Convention::free_base(m);
  const int first = free ? 1 : 0;  // the node of link 0
  std::vector<PeerBody> bodies;
  std::vector<Eigen::Matrix3d> P(size_t(m.body_count()));
  std::vector<Eigen::Vector3d> moments(P.size());
  for (int i = 0; i < m.body_count(); ++i) {
    bodies.push_back(peer_body(m, i));
    P[size_t(i)] = principal_axes(bodies.back(), moments[size_t(i)]);
  }
  // A free base moves against the frame of its joint, and so the world is that frame.
  Eigen::Vector3d g(m.gravity().x, m.gravity().y, m.gravity().z);
  Convention convention{.angular_first = true, .world_linear = true, .world_angular = true};
  if (free) {
    g = bodies[0].R.transpose() * g;
    convention.point = bodies[0].com;
  }

  auto r = std::make_shared<BulletRun>();
  const int links = m.body_count() - first;
  r->body =
      std::make_unique<btMultiBody>(links, free ? bodies[0].mass : 0,
                                    free ? bullet(moments[0]) : btVector3(0, 0, 0), !free, false);
  for (int k = 0; k < links; ++k) {
    const int node = k + first, parent = m.nodes()[size_t(node)].parent;
    const PeerBody& b = bodies[size_t(node)];
    const Eigen::Matrix3d Q = P[size_t(node)].transpose();
    Eigen::Matrix3d from_parent = Q * b.R.transpose();
    Eigen::Vector3d pivot = b.r;
    if (parent >= 0) {
      from_parent *= P[size_t(parent)];
      pivot = P[size_t(parent)].transpose() * (b.r - bodies[size_t(parent)].com);
    }
    const auto setup =
        is_joint(m, node, "revolute") ? &btMultiBody::setupRevolute : &btMultiBody::setupPrismatic;
    ((*r->body).*setup)(k, b.mass, bullet(moments[size_t(node)]), parent - first,
                        bullet(Eigen::Quaterniond(from_parent)), bullet(Q.col(2)), bullet(pivot),
                        bullet(Q * b.com), true);
    r->weight.push_back(bullet(b.mass * g));
  }
  r->body->finalizeMultiDof();
  r->body->setLinearDamping(0);
  r->body->setAngularDamping(0);
  for (size_t s = 0; s < c.q.size(); ++s) {
    BulletState x;
    Eigen::VectorXd v = convention.to_peer(m, c.q[s], c.v[s]);
    Eigen::VectorXd tau = convention.force_to_peer(m, c.q[s], c.tau[s]);
    if (free) {
      const Eigen::Quaterniond R(c.q[s][3], c.q[s][4], c.q[s][5], c.q[s][6]);
      x.position = bullet(Eigen::Vector3d(c.q[s][0], c.q[s][1], c.q[s][2]) + R * bodies[0].com);
      x.world_to_base = bullet((R * Eigen::Quaterniond(P[0])).conjugate());
      x.omega = bullet(v.head<3>());
      x.velocity = bullet(v.segment<3>(3));
      x.torque = bullet(tau.head<3>());
      x.force = bullet(tau.segment<3>(3) + bodies[0].mass * g);
    }
    x.q.assign(c.q[s].end() - links, c.q[s].end());
    x.v.assign(v.end() - links, v.end());
    x.tau.assign(tau.end() - links, tau.end());
    r->states.push_back(x);
  }

  Subject s;
  s.name =
      "Bullet " + std::to_string(btGetVersion() / 100) + "." + std::to_string(btGetVersion() % 100);
  s.aba = [r](int i) { r->aba(i); };
  convention.add_checks(
      s, c, [r] { return r->accelerations(); }, nullptr, nullptr);
  return s;
}

}  // namespace porthos::bench
