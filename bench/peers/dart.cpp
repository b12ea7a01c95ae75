// DART (Lee et al. 2018), in a library of its own: Debian's is compiled without AVX, so that its
// Eigen aligns to 16 bytes and that of a build for this processor to 32. The two must not meet
// (dart_open.cpp, CMakeLists.txt). Positions and velocities that are set mark what depends on them
// as old: each call computes it again, as a step would.
#include <algorithm>
#include <dart/config.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/PrismaticJoint.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>

#include "bench/peers/subject.h"

namespace porthos::bench {
namespace {

namespace dyn = ::dart::dynamics;

struct DartRun {
  dyn::SkeletonPtr skeleton = dyn::Skeleton::create();
  std::vector<Eigen::VectorXd> q, v, tau, a;
  const Eigen::MatrixXd* M = nullptr;

  void aba(int i) {
    const auto s = size_t(i);
    skeleton->setPositions(q[s]);
    skeleton->setVelocities(v[s]);
    skeleton->setForces(tau[s]);
    skeleton->computeForwardDynamics();
  }
  void rnea(int i) {
    const auto s = size_t(i);
    skeleton->setPositions(q[s]);
    skeleton->setVelocities(v[s]);
    skeleton->setAccelerations(a[s]);
    skeleton->computeInverseDynamics();
  }
  /// Its mass matrix: the dynamics of one unit acceleration after the other.
  void crba(int i) {
    skeleton->setPositions(q[size_t(i)]);
    M = &skeleton->getMassMatrix();
  }
};

template <class Joint>
dyn::BodyNode* add(dyn::Skeleton& skeleton, dyn::BodyNode* parent, const PeerBody& b,
                   const std::string& name) {
  typename Joint::Properties p;
  p.mName = "j" + name;
  p.mT_ParentBodyToJoint.linear() = b.R;
  p.mT_ParentBodyToJoint.translation() = b.r;
  if constexpr (requires { p.mAxis; }) p.mAxis = Eigen::Vector3d::UnitZ();
  dyn::BodyNode::Properties q;
  q.mName = "b" + name;
  q.mInertia = dyn::Inertia(b.mass, b.com, b.inertia_at_com);
  return skeleton.createJointAndBodyNodePair<Joint>(parent, p, q).second;
}

Subject make_subject(const Case& c) {
  const mechanics::Mechanism& m = *c.model;
  const Convention convention{.angular_first = true};
  auto r = std::make_shared<DartRun>();
  r->skeleton->setGravity({m.gravity().x, m.gravity().y, m.gravity().z});
  std::vector<dyn::BodyNode*> body;
  for (int i = 0; i < m.body_count(); ++i) {
    const int node = m.nodes()[size_t(i)].parent;
    const auto make = is_joint(m, i, "free")       ? &add<dyn::FreeJoint>
                      : is_joint(m, i, "revolute") ? &add<dyn::RevoluteJoint>
                                                   : &add<dyn::PrismaticJoint>;
    body.push_back(make(*r->skeleton, node < 0 ? nullptr : body[size_t(node)], peer_body(m, i),
                        std::to_string(i)));
  }
  for (size_t s = 0; s < c.q.size(); ++s) {
    const Vec& own = c.q[s];
    Eigen::VectorXd q(m.nv());
    if (Convention::free_base(m)) {
      Eigen::Isometry3d base(Eigen::Quaterniond(own[3], own[4], own[5], own[6]));
      base.translation() = Eigen::Vector3d(own[0], own[1], own[2]);
      q.head<6>() = dyn::FreeJoint::convertToPositions(base);
      std::copy(own.begin() + 7, own.end(), q.begin() + 6);
    } else {
      std::copy(own.begin(), own.end(), q.begin());
    }
    r->q.push_back(q);
    r->v.push_back(convention.to_peer(m, own, c.v[s]));
    r->tau.push_back(convention.force_to_peer(m, own, c.tau[s]));
    r->a.push_back(convention.acceleration_to_peer(m, own, c.v[s], c.tau[s]));
  }

  Subject s;
  s.name = "DART " DART_VERSION;
  s.aba = [r](int i) { r->aba(i); };
  s.rnea = [r](int i) { r->rnea(i); };
  s.crba = [r](int i) { r->crba(i); };
  convention.add_checks(
      s, c, [r] { return r->skeleton->getAccelerations(); },
      [r] { return r->skeleton->getForces(); }, [r] { return *r->M; });
  return s;
}

}  // namespace
}  // namespace porthos::bench

/// What dart_open.cpp looks for.
extern "C" [[gnu::visibility("default")]] void porthos_dart_subject(const porthos::bench::Case& c,
                                                                    porthos::bench::Subject& s) {
  s = porthos::bench::make_subject(c);
}
