// Pinocchio (Carpentier et al. 2019), header-only: its templates are compiled with the flags of
// this build.
#include <pinocchio/fwd.hpp>
//
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea-derivatives.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody/data.hpp>
#include <pinocchio/multibody/model.hpp>

#include "bench/peers/subject.h"

namespace porthos::bench {
namespace {

namespace pin = pinocchio;

struct Run {
  pin::Model model;
  std::unique_ptr<pin::Data> data;
  std::vector<Eigen::VectorXd> q, v, tau;

  // Of the two forms of ABA and CRBA the one in local frames: it is the faster on these models and
  // keeps its digits far from the world's origin.
  const Eigen::VectorXd& aba(int i) {
    const auto s = size_t(i);
    return pin::aba(model, *data, q[s], v[s], tau[s], pin::Convention::LOCAL);
  }
  const Eigen::VectorXd& rnea(int i) {
    const auto s = size_t(i);
    return pin::rnea(model, *data, q[s], v[s], tau[s]);
  }
  const Eigen::MatrixXd& crba(int i) {
    return pin::crba(model, *data, q[size_t(i)], pin::Convention::LOCAL);
  }
  void rnea_derivatives(int i) {
    const auto s = size_t(i);
    pin::computeRNEADerivatives(model, *data, q[s], v[s], tau[s]);
  }
  void aba_derivatives(int i) {
    const auto s = size_t(i);
    pin::computeABADerivatives(model, *data, q[s], v[s], tau[s]);
  }
};

}  // namespace

Subject pinocchio_subject(const Case& c) {
  const mechanics::Mechanism& m = *c.model;
  const Convention convention;
  auto r = std::make_shared<Run>();
  r->model.gravity.linear() = Eigen::Vector3d(m.gravity().x, m.gravity().y, m.gravity().z);
  std::vector<pin::JointIndex> id;
  for (int i = 0; i < m.body_count(); ++i) {
    const PeerBody b = peer_body(m, i);
    const int parent = m.nodes()[size_t(i)].parent;
    const pin::JointModel joint =
        is_joint(m, i, "free")       ? pin::JointModel(pin::JointModelFreeFlyer())
        : is_joint(m, i, "revolute") ? pin::JointModel(pin::JointModelRZ())
                                     : pin::JointModel(pin::JointModelPZ());
    id.push_back(r->model.addJoint(parent < 0 ? 0 : id[size_t(parent)], joint, pin::SE3(b.R, b.r),
                                   "j" + std::to_string(i)));
    r->model.appendBodyToJoint(id.back(),
                               pin::Inertia(b.mass, b.com, pin::Symmetric3(b.inertia_at_com)),
                               pin::SE3::Identity());
  }
  for (size_t s = 0; s < c.q.size(); ++s) {
    Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(c.q[s].data(), m.nq());
    if (Convention::free_base(m)) q.segment<4>(3) << c.q[s][4], c.q[s][5], c.q[s][6], c.q[s][3];
    r->q.push_back(q);
    r->v.push_back(convention.to_peer(m, c.q[s], c.v[s]));
    r->tau.push_back(convention.force_to_peer(m, c.q[s], c.tau[s]));
  }
  r->data = std::make_unique<pin::Data>(r->model);
  r->data->M.setZero();

  Subject s;
  s.name = "Pinocchio " PINOCCHIO_VERSION;
  s.aba = [r](int i) { r->aba(i); };
  s.rnea = [r](int i) { r->rnea(i); };
  s.crba = [r](int i) { r->crba(i); };
  convention.add_checks(
      s, c, [r] { return r->data->ddq; }, [r] { return r->data->tau; },
      [r] { return Eigen::MatrixXd(r->data->M.selfadjointView<Eigen::Upper>()); });
  // Both take the derivative by a free base along its twists in its own axes.
  const auto T = [model = c.model, convention, q = c.q](int i) {
    return convention.rates(*model, q[size_t(i)]);
  };
  const auto columns = [](const auto&... part) {
    Vec all;
    (all.insert(all.end(), part.data(), part.data() + part.size()), ...);
    return all;
  };
  s.rnea_derivatives = [r](int i) { r->rnea_derivatives(i); };
  s.aba_derivatives = [r](int i) { r->aba_derivatives(i); };
  s.torque_slopes = [=](int i) {
    r->rnea_derivatives(i);
    const Eigen::MatrixXd t = T(i), q = t.transpose() * r->data->dtau_dq * t,
                          v = t.transpose() * r->data->dtau_dv * t;
    return columns(q, v);
  };
  s.acceleration_slopes = [=](int i) {
    r->aba_derivatives(i);
    const Eigen::MatrixXd t = T(i), back = t.inverse(), q = back * r->data->ddq_dq * t,
                          v = back * r->data->ddq_dv * t;
    const Eigen::MatrixXd half = r->data->Minv.selfadjointView<Eigen::Upper>();
    return columns(q, v, Eigen::MatrixXd(back * half * back.transpose()));
  };
  return s;
}

}  // namespace porthos::bench
