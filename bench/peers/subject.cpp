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
  const auto X = mechanics::neutral_pose(n);
  PeerBody b;
  b.R.col(0) = vec(X.R.x);
  b.R.col(1) = vec(X.R.y);
  b.R.col(2) = vec(X.R.z);
  b.r = vec(X.r);
  b.mass = n.inertia.m;
  b.com = b.mass > 0 ? Eigen::Vector3d(vec(n.inertia.mc) / b.mass) : Eigen::Vector3d::Zero();
  const auto& I = n.inertia.I;
  b.inertia_at_com << I.xx, I.xy, I.xz, I.xy, I.yy, I.yz, I.xz, I.yz, I.zz;
  b.inertia_at_com -=
      b.mass * (b.com.squaredNorm() * Eigen::Matrix3d::Identity() - b.com * b.com.transpose());
  return b;
}

bool Convention::free_base(const mechanics::Mechanism& m) { return is_joint(m, 0, "free"); }

namespace {
Eigen::VectorXd eigen(const Vec& x) {
  return Eigen::Map<const Eigen::VectorXd>(x.data(), Eigen::Index(x.size()));
}
template <class X>
Vec plain(const X& x) {
  return Vec(x.data(), x.data() + x.size());
}
}  // namespace

Eigen::MatrixXd Convention::rates(const mechanics::Mechanism& m, const Vec& q) const {
  Eigen::MatrixXd T = Eigen::MatrixXd::Identity(m.nv(), m.nv());
  if (!free_base(m)) return T;
  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d R = Eigen::Quaterniond(q[3], q[4], q[5], q[6]).toRotationMatrix();
  Eigen::Matrix3d to_point;  // ω × point = to_point ω
  to_point << 0, point.z(), -point.y(), -point.z(), 0, point.x(), point.y(), -point.x(), 0;
  const int angular = angular_first ? 0 : 3, linear = 3 - angular;
  T.topLeftCorner(6, 6).setZero();
  T.block<3, 3>(angular, 0) = world_angular ? R : one;
  T.block<3, 3>(linear, 3) = world_linear ? R : one;
  T.block<3, 3>(linear, 0) = T.block<3, 3>(linear, 3) * to_point;
  return T;
}

Eigen::VectorXd Convention::to_peer(const mechanics::Mechanism& m, const Vec& q,
                                    const Vec& v) const {
  return rates(m, q) * eigen(v);
}
Eigen::VectorXd Convention::force_to_peer(const mechanics::Mechanism& m, const Vec& q,
                                          const Vec& tau) const {
  return rates(m, q).transpose().partialPivLu().solve(eigen(tau));
}

namespace {
/// What the derivative of T adds to T v̇, in the order of Porthos' rates and in body axes: ω × (v +
/// ω × point).
Eigen::VectorXd convective(const Convention& c, const mechanics::Mechanism& m, const Vec& v) {
  Eigen::VectorXd a = Eigen::VectorXd::Zero(m.nv());
  if (!c.world_linear || !Convention::free_base(m)) return a;
  const Eigen::Vector3d w(v[0], v[1], v[2]);
  a.segment<3>(3) = w.cross(Eigen::Vector3d(v[3], v[4], v[5]) + w.cross(c.point));
  return a;
}
}  // namespace

Eigen::VectorXd Convention::acceleration_to_peer(const mechanics::Mechanism& m, const Vec& q,
                                                 const Vec& v, const Vec& a) const {
  return rates(m, q) * (eigen(a) + convective(*this, m, v));
}

void Convention::add_checks(Subject& s, const Case& c, Left accelerations, Left forces,
                            std::function<Eigen::MatrixXd()> mass_matrix) const {
  const auto model = c.model;
  const auto T = [own = *this, model, q = c.q](int i) { return own.rates(*model, q[size_t(i)]); };
  if (accelerations)
    s.acceleration = [=, own = *this, v = c.v, run = s.aba](int i) {
      run(i);
      const Eigen::VectorXd a = T(i).partialPivLu().solve(accelerations());
      return plain(Eigen::VectorXd(a - convective(own, *model, v[size_t(i)])));
    };
  if (forces)
    s.torque = [=, run = s.rnea](int i) {
      run(i);
      return plain(Eigen::VectorXd(T(i).transpose() * forces()));
    };
  if (mass_matrix)
    s.mass_matrix = [=, run = s.crba](int i) {
      run(i);
      return plain(Eigen::MatrixXd(T(i).transpose() * mass_matrix() * T(i)));
    };
}

}  // namespace porthos::bench
