#include "mechanics/detail/body_checks.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace porthos::mechanics {
namespace {

/// Principal moments, ascending.
Eigen::Vector3d eigenvalues(const Sym3<double>& S) {
  Eigen::Matrix3d m;
  m << S.xx, S.xy, S.xz, S.xy, S.yy, S.yz, S.xz, S.yz, S.zz;
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(m, Eigen::EigenvaluesOnly).eigenvalues();
}

/// Files hold rounded digits: a triangle inequality violated by less than this is rounding.
constexpr double triangle_slack = 1e-6;

/// A body whose radius of gyration is below this is a point: its moments are rounding of either
/// sign.
constexpr double point_radius = 1e-7;    // m
constexpr double point_inertia = 1e-18;  // kg m^2, for a body whose mass is rounding as well

/// The possible rounding error of principal moments.
double inertia_slack(double mass, double largest) {
  return std::max({triangle_slack * largest, point_radius * point_radius * mass, point_inertia});
}

}  // namespace

bool is_rotation(const Mat3<double>& R) {
  const auto near = [](double a, double b) { return std::fabs(a - b) < 1e-6; };
  return near(dot(R.x, R.x), 1) && near(dot(R.y, R.y), 1) && near(dot(R.z, R.z), 1) &&
         near(dot(R.x, R.y), 0) && near(dot(cross(R.x, R.y), R.z), 1);
}

void refuse(const BodySpec& b, const std::string& text) {
  throw InvalidArgument(in_file(b.where) + "body '" + b.name + "': " + text);
}
void refuse_joint(const BodySpec& b, const std::string& text) {
  throw InvalidArgument(in_file(b.joint.where.empty() ? b.where : b.joint.where) + "joint '" +
                        (b.joint.name.empty() ? b.name : b.joint.name) + "': " + text);
}

std::string inertia_fault(double mass, const Sym3<double>& inertia) {
  const auto e = eigenvalues(inertia);
  const double slack = inertia_slack(mass, e[2]);
  if (e[0] < -slack)
    return "inertia is not positive: its smallest principal moment is " + number(e[0]) + " kg m^2";
  if (e[0] + e[1] < e[2] - slack)
    return "inertia breaks the triangle inequality: principal moments " + number(e[0]) + ", " +
           number(e[1]) + ", " + number(e[2]) +
           " kg m^2, expected the largest <= the sum of the other two";
  if (mass == 0 && e[2] > slack) return "has inertia but no mass";
  return "";
}

double lift_to_zero(MassProperties& m) {
  Sym3<double>& S = m.inertia;
  Eigen::Matrix3d full;
  full << S.xx, S.xy, S.xz, S.xy, S.yy, S.yz, S.xz, S.yz, S.zz;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(full);
  const Eigen::Vector3d& e = solver.eigenvalues();
  if (!(e[0] < 0) || e[0] < -inertia_slack(m.mass, e[2])) return 0;
  const Eigen::Matrix3d& V = solver.eigenvectors();
  full = V * e.cwiseMax(0).asDiagonal() * V.transpose();
  S = {full(0, 0), full(0, 1), full(0, 2), full(1, 1), full(1, 2), full(2, 2)};
  return e[0];
}

double smallest_principal_moment(const Sym3<double>& inertia) { return eigenvalues(inertia)[0]; }

void check_numbers(const BodySpec& b) {
  const MassProperties& m = b.mass;
  if (!std::isfinite(m.mass) || m.mass < 0)
    refuse(b, "mass is " + number(m.mass) + " kg, expected a number >= 0");
  if (!finite(m.com)) refuse(b, "centre of mass is not finite");
  if (!is_rotation(m.axes)) refuse(b, "inertia axes are not a rotation");
  if (!finite(b.placement.r) || !is_rotation(b.placement.R))
    refuse_joint(b, "placement is not a finite pose");
  const auto& I = m.inertia;
  if (!std::isfinite(I.xx + I.xy + I.xz + I.yy + I.yz + I.zz)) refuse(b, "inertia is not finite");
}

}  // namespace porthos::mechanics
