#include <Eigen/Cholesky>

#include "phs/error.h"
#include "planning/whole_body.h"

namespace porthos::planning {

void append(TaskLevel& level, const TaskLevel& more, double weight) {
  for (const double a : more.A) level.A.push_back(weight * a);
  for (const double b : more.b) level.b.push_back(weight * b);
  level.C.insert(level.C.end(), more.C.begin(), more.C.end());
  level.c.insert(level.c.end(), more.c.begin(), more.c.end());
}

mechanics::Vec3d zero_moment_point(double mass, double g, const mechanics::Vec3d& com,
                                   const mechanics::Vec3d& com_acceleration,
                                   const mechanics::Vec3d& k_rate) {
  const double up = g + com_acceleration.z;
  if (!(mass > 0) || !(up > 0))
    throw InvalidArgument("a zero moment point needs a positive mass and g + z'' > 0, not " +
                          std::to_string(mass) + " kg and " + std::to_string(up) + " m/s²");
  // k' × e_z = (k'_y, -k'_x, 0)
  return {com.x - com.z * com_acceleration.x / up - k_rate.y / (mass * up),
          com.y - com.z * com_acceleration.y / up + k_rate.x / (mass * up), 0};
}

void operational_space_torque(std::span<const double> M, std::span<const double> b,
                              std::span<const double> J, std::span<const double> J_dot_v,
                              std::span<const double> acceleration, std::span<const double> tau0,
                              std::span<double> tau) {
  using Vector = Eigen::VectorXd;
  const size_t n = tau.size(), m = acceleration.size();
  require_size("M", M.size(), n * n);
  require_size("b", b.size(), n);
  require_size("J", J.size(), m * n);
  require_size("J_dot_v", J_dot_v.size(), m);
  if (!tau0.empty()) require_size("tau0", tau0.size(), n);
  const auto vector = [](std::span<const double> v) {
    return Eigen::Map<const Vector>(v.data(), long(v.size()));
  };
  const Eigen::Map<const Eigen::Matrix<double, -1, -1, Eigen::RowMajor>> Jt(J.data(), long(m),
                                                                            long(n));
  const Eigen::LLT<Eigen::MatrixXd> mass(
      Eigen::Map<const Eigen::MatrixXd>(M.data(), long(n), long(n)));
  if (mass.info() != Eigen::Success) throw InvalidArgument("M is not positive definite");
  const Eigen::MatrixXd MJ = mass.solve(Jt.transpose());  // M⁻¹Jᵀ
  const Eigen::LLT<Eigen::MatrixXd> lambda(Jt * MJ);      // Λ⁻¹
  if (lambda.info() != Eigen::Success || !(lambda.rcond() > 1e-14))
    throw InvalidArgument("the Jacobian of an operational-space task has not full rank");
  Vector rest = vector(b);
  if (!tau0.empty()) rest -= vector(tau0);
  const Vector force = lambda.solve(vector(acceleration) - vector(J_dot_v) + MJ.transpose() * rest);
  Eigen::Map<Vector> out(tau.data(), long(n));
  out = Jt.transpose() * force;
  if (!tau0.empty()) out += vector(tau0);
}

}  // namespace porthos::planning
