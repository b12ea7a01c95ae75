#include "planning/detail/whole_body_work.h"

/// The tasks of WholeBody: rows over (v', f/m) at the state of the last update().
namespace porthos::planning {

TaskLevel WholeBody::Work::rows(const std::string& name, const Matrix6& J,
                                const Eigen::Matrix<double, 6, 1>& dr,
                                std::span<const double> wanted) const {
  require_size(name.c_str(), wanted.size(), 6);
  TaskLevel level{name, {}, {}, {}, {}};
  for (long i = 0; i < 6; ++i) {
    if (std::isnan(wanted[size_t(i)])) continue;
    level.A.resize(level.A.size() + size_t(n), 0.0);
    Eigen::Map<Eigen::RowVectorXd>(level.A.data() + level.A.size() - n, nv) = J.row(i);
    level.b.push_back(wanted[size_t(i)] - dr[i]);
  }
  return level;
}

TaskLevel WholeBody::frame(const std::string& body, const Vec3d& position,
                           std::span<const double> acceleration) const {
  auto frame = work_->m->body(body);
  if (frame.node < 0) throw InvalidArgument("a task is on '" + body + "', which never moves");
  frame.pose.r = frame.pose.R * position + frame.pose.r;
  return work_->rows("frame of " + body, work_->jacobian(frame), work_->drift(frame), acceleration);
}

TaskLevel WholeBody::momentum(std::span<const double> rate) const {
  const Work& w = *work_;
  Matrix6 A(6, w.nv);
  mechanics::centroidal_momentum_matrix<double>(*w.m, w.kernel, w.q, {A.data(), size_t(A.size())});
  const Vec3d com = mechanics::centre_of_mass<double>(*w.m, w.kernel, w.q);
  const Vec3d k = w.net.n - mechanics::cross(com, w.net.f);  // gravity has no moment about it
  const Vec3d l = w.net.f + w.mass * w.m->gravity();
  Eigen::Matrix<double, 6, 1> drift;
  drift << k.x, k.y, k.z, l.x, l.y, l.z;
  std::vector<double> wanted(rate.begin(), rate.end());
  for (auto& x : wanted) x /= w.mass;
  return w.rows("momentum", A / w.mass, drift / w.mass, wanted);
}

TaskLevel WholeBody::centre_of_mass(std::span<const double> acceleration) const {
  require_size("centre of mass", acceleration.size(), 3);
  std::vector<double> rate(6, NAN);
  for (size_t i = 0; i < 3; ++i) rate[3 + i] = work_->mass * acceleration[i];
  auto level = momentum(rate);
  level.name = "centre of mass";
  return level;
}

TaskLevel WholeBody::joints(std::span<const double> v_dot) const {
  const Work& w = *work_;
  require_size("joints", v_dot.size(), size_t(w.nv));
  TaskLevel level{"joints", {}, {}, {}, {}};
  for (size_t i = 0; i < size_t(w.nv); ++i) {
    if (std::isnan(v_dot[i])) continue;
    level.A.resize(level.A.size() + size_t(w.n), 0.0);
    level.A[level.A.size() - size_t(w.n) + i] = 1;
    level.b.push_back(v_dot[i]);
  }
  return level;
}

TaskLevel WholeBody::still_contacts() const {
  TaskLevel level{"contacts stay", {}, {}, {}, {}};
  work_->keep_contacts(level, Touch::pushes);
  return level;
}

PointMotion WholeBody::point(const std::string& body, const Vec3d& position) const {
  auto frame = work_->m->body(body);
  if (frame.node < 0) throw InvalidArgument("'" + body + "' never moves");
  frame.pose.r = frame.pose.R * position + frame.pose.r;
  return work_->point(frame);
}

WholeBody::Centre WholeBody::centre() const {
  const Work& w = *work_;
  mechanics::Force<double> h{{0, 0, 0}, {0, 0, 0}};  // about the world's origin
  Vec3d mc{0, 0, 0};
  for (size_t i = 0; i < w.pose.size(); ++i) {
    const auto& I = w.m->nodes()[i].inertia;
    h += w.pose[i].to_parent(I * w.V[i]);
    mc += I.m * w.pose[i].r + w.pose[i].R * I.mc;
  }
  const Vec3d at = (1 / w.mass) * mc;
  return {at, (1 / w.mass) * h.f, h.n - mechanics::cross(at, h.f)};
}

TaskLevel WholeBody::small_forces() const {
  const auto n = size_t(work_->n), nv = size_t(work_->nv);
  TaskLevel level{"small forces",
                  std::vector<double>((n - nv) * n, 0.0),
                  std::vector<double>(n - nv, 0.0),
                  {},
                  {}};
  for (size_t k = 0; k < n - nv; ++k) level.A[k * n + nv + k] = 1;
  return level;
}

}  // namespace porthos::planning
