#pragma once
#include <cmath>
#include <cstdlib>
#include <string>

#include "mechanics/builder.h"
#include "mechanics/mechanical_model.h"
#include "tests/support/reference.h"

/// Mechanisms and numbers out of the reference cases (decimal strings).
namespace porthos::test {

/// Of 2.5, "2.5" or "5/2".
inline double number(const nlohmann::json& s) {
  if (!s.is_string()) return s.get<double>();
  const std::string text = s;
  const size_t slash = text.find('/');
  const double above = std::strtod(text.c_str(), nullptr);
  return slash == text.npos ? above : above / std::strtod(text.c_str() + slash + 1, nullptr);
}
inline std::vector<double> numbers(const nlohmann::json& a) {
  std::vector<double> v;
  for (const auto& x : a) v.push_back(number(x));
  return v;
}
inline mechanics::Vec3d vec3(const nlohmann::json& a) {
  return {number(a[0]), number(a[1]), number(a[2])};
}

/// The tree of a case with generator "tree" (README of the reference cases, section 2).
inline std::shared_ptr<const mechanics::Mechanism> tree_mechanism(const nlohmann::json& file) {
  const auto& p = file["generator"]["parameters"];
  mechanics::MechanismBuilder b(file["case"]);
  b.gravity(vec3(p["gravity"]));
  for (int i = 0; i < p["nb"].get<int>(); ++i) {
    const std::string at = "body" + std::to_string(i) + ".";
    mechanics::BodySpec s;
    s.name = "body" + std::to_string(i);
    const int parent = p[at + "parent"];
    s.parent = parent < 0 ? "world" : "body" + std::to_string(parent);
    const std::string joint = p[at + "joint"];
    s.joint.type = joint == "R" ? "revolute" : joint == "P" ? "prismatic" : "free";
    if (p.contains(at + "axis")) s.joint.axis = vec3(p[at + "axis"]);
    if (p.contains(at + "k")) {
      s.joint.stiffness = number(p[at + "k"]);
      s.joint.damping = number(p[at + "d"]);
      s.joint.rest = number(p[at + "q0"]);
    }
    s.placement.r = vec3(p[at + "placement"]);
    const auto I = numbers(p[at + "inertia"]);  // xx yy zz xy xz yz
    s.mass = {number(p[at + "mass"]), vec3(p[at + "com"]), {I[0], I[3], I[4], I[1], I[5], I[2]}};
    b.add(s);
  }
  return std::make_shared<mechanics::Mechanism>(b.build());
}

/// A planar chain of links hanging along -y, absolute angles (generator "chain"); "ddp" is its
/// one-link case.
inline std::shared_ptr<const mechanics::Mechanism> planar_chain(const std::vector<double>& m,
                                                                const std::vector<double>& L,
                                                                const std::vector<double>& c,
                                                                const std::vector<double>& I,
                                                                double g) {
  mechanics::MechanismBuilder b("planar chain");
  b.gravity({0, -g, 0});
  for (size_t i = 0; i < m.size(); ++i) {
    mechanics::BodySpec s;
    s.name = "link" + std::to_string(i);
    s.parent = i == 0 ? "world" : "link" + std::to_string(i - 1);
    s.joint.type = "revolute";
    if (i > 0) s.placement.r = {0, -L[i - 1], 0};
    // About z only I counts; the other moments make the link a physical body.
    s.mass = {m[i], {0, -c[i], 0}, {I[i] / 2, 0, 0, I[i] / 2, 0, I[i]}};
    b.add(s);
  }
  return std::make_shared<mechanics::Mechanism>(b.build());
}

/// q and v of a tree case's flat "positions then velocities" row: base origin velocity and angular
/// velocity inertial.
inline void split_row(const mechanics::Mechanism& m, const std::vector<double>& row,
                      std::vector<double>& q, std::vector<double>& v) {
  const size_t nq = size_t(m.nq());
  q.assign(row.begin(), row.begin() + long(nq));
  v.assign(row.begin() + long(nq), row.end());
  if (nq == size_t(m.nv())) return;
  const auto R = mechanics::rotation_matrix(mechanics::Quaternion<double>::load(&q[3]));
  const auto w = R.tmul({v[3], v[4], v[5]}), u = R.tmul({v[0], v[1], v[2]});
  for (int k = 0; k < 3; ++k) {
    v[size_t(k)] = w[k];
    v[size_t(3 + k)] = u[k];
  }
}
inline std::vector<double> join_row(const mechanics::Mechanism& m, const std::vector<double>& q,
                                    std::vector<double> v) {
  if (m.nq() != m.nv()) {
    const auto R = mechanics::rotation_matrix(mechanics::Quaternion<double>::load(&q[3]));
    const auto w = R * mechanics::Vec3d{v[0], v[1], v[2]},
               u = R * mechanics::Vec3d{v[3], v[4], v[5]};
    for (int k = 0; k < 3; ++k) {
      v[size_t(k)] = u[k];
      v[size_t(3 + k)] = w[k];
    }
  }
  std::vector<double> row = q;
  row.insert(row.end(), v.begin(), v.end());
  return row;
}

/// Largest relative difference as the cases define it: against max(|component| over time, 1e-3).
class RowError {
 public:
  explicit RowError(const nlohmann::json& outputs, const char* group = "group0") {
    for (const auto& o : outputs) {
      const auto row = numbers(o[group]);
      scale_.resize(row.size(), 1e-3);
      for (size_t i = 0; i < row.size(); ++i) scale_[i] = std::max(scale_[i], std::fabs(row[i]));
    }
  }
  double operator()(const std::vector<double>& row, const std::vector<double>& reference) const {
    double worst = 0;
    for (size_t i = 0; i < row.size(); ++i)
      worst = std::max(worst, std::fabs(row[i] - reference[i]) / scale_[i]);
    return worst;
  }

 private:
  std::vector<double> scale_;
};

/// What a converged double-precision run may differ by where the amplification of a perturbation is
/// kappa.
inline double double_bound(double kappa) { return std::max(1e-12, 1e-14 * kappa); }

}  // namespace porthos::test
