#include "bench/peers/subject.h"

#include <stdexcept>

#include "bench/chain.h"
#include "mechanics/joint_list.h"

namespace porthos::bench {

Case make_case(std::shared_ptr<const mechanics::Mechanism> model, int states) {
  Case c{model, {}, {}, {}};
  for (int i = 0; i < states; ++i) {
    c.q.push_back(configuration(*model, std::uint64_t(i) + 1));
    c.v.push_back(numbers(size_t(model->nv()), 1, std::uint64_t(i) + 1001));
    c.tau.push_back(numbers(size_t(model->nv()), 10, std::uint64_t(i) + 2001));
  }
  return c;
}

bool is_joint(const mechanics::Mechanism& m, int node, std::string_view name) {
  bool yes = false;
  mechanics::visit_joint(m.nodes()[size_t(node)].type,
                         [&](auto J) { yes = decltype(J)::name == name; });
  return yes;
}

PeerBody peer_body(const mechanics::Mechanism& m, int node) {
  const mechanics::Node& n = m.nodes()[size_t(node)];
  const bool known = is_joint(m, node, "revolute") || is_joint(m, node, "prismatic") ||
                     (is_joint(m, node, "free") && node == 0);
  if (!known || n.rotor_inertia != 0)
    throw std::runtime_error(m.name() + ": only revolute, prismatic and free root joints without " +
                             "rotors can be compared");
  const auto vec = [](const mechanics::Vec3d& v) { return Eigen::Vector3d(v.x, v.y, v.z); };
  PeerBody b;
  b.R.col(0) = vec(n.placement.R.x), b.R.col(1) = vec(n.placement.R.y),
  b.R.col(2) = vec(n.placement.R.z);
  b.r = vec(n.placement.r), b.mass = n.inertia.m;
  b.com = b.mass > 0 ? Eigen::Vector3d(vec(n.inertia.mc) / b.mass) : Eigen::Vector3d::Zero();
  const auto& I = n.inertia.I;
  b.inertia_at_com << I.xx, I.xy, I.xz, I.xy, I.yy, I.yz, I.xz, I.yz, I.zz;
  b.inertia_at_com -=
      b.mass * (b.com.squaredNorm() * Eigen::Matrix3d::Identity() - b.com * b.com.transpose());
  return b;
}

bool Convention::free_base(const mechanics::Mechanism& m) { return is_joint(m, 0, "free"); }

Eigen::MatrixXd Convention::rates(const mechanics::Mechanism& m, const Vec& q) const {
  Eigen::MatrixXd T = Eigen::MatrixXd::Identity(m.nv(), m.nv());
  if (!free_base(m)) return T;
  T.topLeftCorner(6, 6).setZero();
  T.block<3, 3>(0, 3) = world_linear ? Eigen::Quaterniond(q[3], q[4], q[5], q[6]).toRotationMatrix()
                                     : Eigen::Matrix3d::Identity();
  T.block<3, 3>(3, 0).setIdentity();
  return T;
}

namespace {
Eigen::VectorXd eigen(const Vec& x) {
  return Eigen::Map<const Eigen::VectorXd>(x.data(), Eigen::Index(x.size()));
}
Eigen::VectorXd convective(const mechanics::Mechanism& m, const Vec& v) {
  Eigen::VectorXd c = Eigen::VectorXd::Zero(m.nv());
  c.segment<3>(3) = Eigen::Vector3d(v[0], v[1], v[2]).cross(Eigen::Vector3d(v[3], v[4], v[5]));
  return c;
}
}  // namespace

Eigen::VectorXd Convention::to_peer(const mechanics::Mechanism& m, const Vec& q,
                                    const Vec& x) const {
  return rates(m, q) * eigen(x);
}
Eigen::VectorXd Convention::acceleration_to_peer(const mechanics::Mechanism& m, const Vec& q,
                                                 const Vec& v, const Vec& a) const {
  if (!world_linear || !free_base(m)) return rates(m, q) * eigen(a);
  return rates(m, q) * (eigen(a) + convective(m, v));
}
Eigen::VectorXd Convention::acceleration_from_peer(const mechanics::Mechanism& m, const Vec& q,
                                                   const Vec& v, const Eigen::VectorXd& a) const {
  const Eigen::VectorXd own = rates(m, q).transpose() * a;
  if (!world_linear || !free_base(m)) return own;
  return own - convective(m, v);
}

}  // namespace porthos::bench
