// RBDL (Felis 2017), built by its own CMakeLists; the axes are z throughout, for which it has its
// own joint type.
#include <rbdl/rbdl.h>

#include "bench/peers/subject.h"

namespace porthos::bench {
namespace {

namespace rbd = RigidBodyDynamics;
using rbd::Math::VectorNd;

struct RbdlRun {
  rbd::Model model;
  std::vector<VectorNd> q, v, tau, a;
  VectorNd out;
  rbd::Math::MatrixNd M;

  void aba(int i) {
    const auto s = size_t(i);
    rbd::ForwardDynamics(model, q[s], v[s], tau[s], out);
  }
  void rnea(int i) {
    const auto s = size_t(i);
    rbd::InverseDynamics(model, q[s], v[s], a[s], out);
  }
  void crba(int i) { rbd::CompositeRigidBodyAlgorithm(model, q[size_t(i)], M); }
};

}  // namespace

Subject rbdl_subject(const Case& c) {
  const mechanics::Mechanism& m = *c.model;
  const Convention convention{.world_linear = true};
  auto r = std::make_shared<RbdlRun>();
  r->model.gravity = {m.gravity().x, m.gravity().y, m.gravity().z};
  std::vector<unsigned> id;
  for (int i = 0; i < m.body_count(); ++i) {
    const PeerBody b = peer_body(m, i);
    const int parent = m.nodes()[size_t(i)].parent;
    const rbd::Joint joint =
        is_joint(m, i, "free") ? rbd::Joint(rbd::JointTypeFloatingBase)
        : is_joint(m, i, "revolute")
            ? rbd::Joint(rbd::JointTypeRevoluteZ)
            : rbd::Joint(rbd::JointTypePrismatic, rbd::Math::Vector3d(0, 0, 1));
    rbd::Math::Matrix3d E, I;
    E = b.R.transpose();
    I = b.inertia_at_com;
    id.push_back(r->model.AddBody(parent < 0 ? 0 : id[size_t(parent)],
                                  rbd::Math::SpatialTransform(E, rbd::Math::Vector3d(b.r)), joint,
                                  rbd::Body(b.mass, rbd::Math::Vector3d(b.com), I),
                                  "b" + std::to_string(i)));
  }
  for (size_t s = 0; s < c.q.size(); ++s) {
    VectorNd q = VectorNd::Zero(r->model.q_size);
    if (Convention::free_base(m)) {
      for (int k = 0; k < 3; ++k) q[k] = c.q[s][size_t(k)];
      r->model.SetQuaternion(id[0], {c.q[s][4], c.q[s][5], c.q[s][6], c.q[s][3]}, q);
      for (size_t k = 7; k < c.q[s].size(); ++k) q[Eigen::Index(k) - 1] = c.q[s][k];
    } else {
      for (size_t k = 0; k < c.q[s].size(); ++k) q[Eigen::Index(k)] = c.q[s][k];
    }
    r->q.push_back(q);
    r->v.push_back(convention.to_peer(m, c.q[s], c.v[s]));
    r->tau.push_back(convention.force_to_peer(m, c.q[s], c.tau[s]));
    r->a.push_back(convention.acceleration_to_peer(m, c.q[s], c.v[s], c.tau[s]));
  }
  r->out = VectorNd::Zero(m.nv());
  r->M = rbd::Math::MatrixNd::Zero(m.nv(), m.nv());

  Subject s;
  s.name = "RBDL " + std::to_string(rbdl_get_api_version() >> 16) + "." +
           std::to_string(rbdl_get_api_version() >> 8 & 255) + "." +
           std::to_string(rbdl_get_api_version() & 255);
  s.aba = [r](int i) { r->aba(i); };
  s.rnea = [r](int i) { r->rnea(i); };
  s.crba = [r](int i) { r->crba(i); };
  const auto left = [r] { return Eigen::VectorXd(r->out); };
  convention.add_checks(s, c, left, left, [r] { return r->M; });
  return s;
}

}  // namespace porthos::bench
