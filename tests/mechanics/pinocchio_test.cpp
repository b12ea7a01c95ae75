// Agreement with Pinocchio 3.7 on real robots, fixed and floating (reference/pinocchio, README
// there): every quantity to 1e-12 relative to the largest entry of its kind. Measured: see the
// printed worst values.
#include <cmath>

#include "mechanics/aba.h"
#include "mechanics/crba.h"
#include "mechanics/kinematics.h"
#include "mechanics/mechanical_model.h"
#include "mechanics/momentum.h"
#include "mechanics/rnea.h"
#include "mechanics/urdf.h"
#include "tests/support/reference.h"

namespace porthos::mechanics::pinocchio_test {
namespace {

using nlohmann::json;
using Vec = std::vector<double>;
using test::data_file;
using test::read_json;

Mat3<double> matrix(const json& rows) {
  Mat3<double> m;
  for (int c = 0; c < 3; ++c)
    (c == 0 ? m.x : c == 1 ? m.y : m.z) = {rows[0][c], rows[1][c], rows[2][c]};
  return m;
}

/// Largest |a - b| over max(1e-3, largest |b|).
double relative(const Vec& a, const Vec& b) {
  EXPECT_EQ(a.size(), b.size());
  double diff = 0, size = 1e-3;
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    diff = std::max(diff, std::fabs(a[i] - b[i]));
    size = std::max(size, std::fabs(b[i]));
  }
  return diff / size;
}

/// One file: maps its joint order and conventions to ours.
class Case {
 public:
  explicit Case(const std::string& name)
      : file_(read_json(data_file("reference/pinocchio/" + name + ".json"))) {
    free_ = file_["joints"][0]["nq"] == 7;
    const std::string urdf = name == "mixed_freeflyer" ? "mixed" : name;
    UrdfOptions o;
    o.base = free_ ? UrdfOptions::Base::free : UrdfOptions::Base::fixed;
    o.gravity = {0, 0, -9.81};
    o.links_without_inertia = UrdfOptions::NoInertia::massless;
    o.accept_unphysical_inertia =
        name == "tiago_continuous";  // its arm_1_link breaks the triangle inequality by 2 %
    mechanism_ = std::make_shared<Mechanism>(
        read_urdf(data_file("reference/pinocchio/urdf/" + urdf + ".urdf").string(), o).mechanism);
    // velocity index map: ours -> theirs
    to_theirs_.resize(size_t(mechanism_->nv()));
    for (const auto& j : file_["joints"]) {
      const int iv = j["idx_v"], nv = j["nv"];
      if (nv == 6) {
        for (int k = 0; k < 6; ++k) to_theirs_[size_t(k)] = (k + 3) % 6;  // ours angular first
        continue;
      }
      to_theirs_[size_t(mechanism_->coordinate(j["name"].get<std::string>()).v)] = iv;
    }
  }

  const Mechanism& mechanism() const { return *mechanism_; }
  const json& samples() const {
    return file_.contains("states") ? file_["states"] : file_["samples"];
  }
  const json& file() const { return file_; }

  Vec q(const json& theirs) const {
    Vec q = mechanism_->neutral();
    for (const auto& j : file_["joints"]) {
      const int iq = j["idx_q"], nq = j["nq"];
      if (nq == 7) {
        for (int k = 0; k < 3; ++k) q[size_t(k)] = theirs[iq + k];
        q[3] = theirs[iq + 6];
        for (int k = 0; k < 3; ++k) q[size_t(4 + k)] = theirs[iq + 3 + k];
        continue;
      }
      double& c = q[size_t(mechanism_->coordinate(j["name"].get<std::string>()).q)];
      c = nq == 2 ? std::atan2(double(theirs[iq + 1]), double(theirs[iq])) : double(theirs[iq]);
    }
    return q;
  }
  Vec ours(const json& theirs) const {
    Vec v(to_theirs_.size());
    for (size_t i = 0; i < v.size(); ++i) v[i] = theirs[size_t(to_theirs_[i])];
    return v;
  }
  /// A matrix of `rows` rows (nv columns), theirs row by row, reordered to ours, column-major;
  /// linear-angular rows swapped.
  Vec columns(const json& theirs, int rows, bool swap_rows) const {
    Vec m(size_t(rows) * to_theirs_.size());
    for (size_t c = 0; c < to_theirs_.size(); ++c)
      for (int r = 0; r < rows; ++r) {
        const int row = swap_rows                        ? (r + 3) % 6
                        : rows == int(to_theirs_.size()) ? to_theirs_[size_t(r)]
                                                         : r;
        m[size_t(r) + size_t(rows) * c] = theirs[size_t(row)][size_t(to_theirs_[c])];
      }
    return m;
  }

 private:
  json file_;
  bool free_ = false;
  std::shared_ptr<const Mechanism> mechanism_;
  std::vector<int> to_theirs_;
};

class Pinocchio : public testing::TestWithParam<const char*> {};

TEST_P(Pinocchio, Agrees) {
  const Case c(GetParam());
  const Mechanism& m = c.mechanism();
  Workspace<double> w(m);
  const size_t nv = size_t(m.nv());
  std::map<std::string, double> worst;
  const auto note = [&](const char* what, const Vec& a, const Vec& b) {
    worst[what] = std::max(worst[what], relative(a, b));
  };

  EXPECT_NEAR(m.total_mass() / double(c.file()["total_mass"]), 1, 1e-14);
  ASSERT_EQ(nv, c.samples()[0]["v"].size());
  for (const auto& s : c.samples()) {
    const Vec q = c.q(s["q"]), v = c.ours(s["v"]), tau = c.ours(s["tau"]);
    Vec a(nv), t(nv), M(nv * nv), zero(nv, 0.0);

    aba<double>(m, w, q, v, {tau, {}}, a);
    note("aba", a, c.ours(s["aba"]));
    rnea<double>(m, w, q, v, zero, {}, t);
    note("nle", t, c.ours(s["nle"]));
    rnea<double>(m, w, q, {}, {}, {}, t);
    note("gravity_torque", t, c.ours(s["gravity_torque"]));
    rnea<double>(m, w, q, v, c.ours(s["aba"]), {}, t);
    note("rnea(aba)", t, tau);
    crba<double>(m, w, q, M);
    note("crba", M, c.columns(s["M"], int(nv), false));

    Vec p(q.size());
    momenta_from_rates<double>(m, w, q, v, p);
    note("kinetic_energy", {kinetic_energy<double>(m, w, q, p)}, {s["kinetic_energy"]});
    note("potential_energy", {potential_energy<double>(m, w, q)}, {s["potential_energy"]});
    const auto com = centre_of_mass<double>(m, w, q);
    note("com", {com.x, com.y, com.z}, s["com"].get<Vec>());

    Vec A(6 * nv), k(6, 0.0);
    centroidal_momentum_matrix<double>(m, w, q, A);
    for (size_t j = 0; j < nv; ++j)
      for (size_t r = 0; r < 6; ++r) k[r] += A[r + 6 * j] * v[j];
    note("momentum_linear", {k[3], k[4], k[5]}, s["momentum_linear"].get<Vec>());
    note("momentum_angular", {k[0], k[1], k[2]}, s["momentum_angular_about_com"].get<Vec>());
    const auto P = momentum<double>(m, w, q, p);
    const auto about_com = P.angular - cross(com, P.linear);
    note("momentum(p) angular", {about_com.x, about_com.y, about_com.z},
         s["momentum_angular_about_com"].get<Vec>());

    const auto& f = c.file()["frame"];
    const BodyFrame& body = m.body(f["name"].get<std::string>());
    std::vector<Transform<double>> pose(m.nodes().size());
    forward_kinematics<double>(m, w, q, pose);
    const auto X = body_pose<double>(m, body, pose);
    note("frame_p", {X.r.x, X.r.y, X.r.z}, s["frame_p"].get<Vec>());
    const auto R = matrix(s["frame_R"]);
    note("frame_R",
         {X.R.x.x, X.R.x.y, X.R.x.z, X.R.y.x, X.R.y.y, X.R.y.z, X.R.z.x, X.R.z.y, X.R.z.z},
         {R.x.x, R.x.y, R.x.z, R.y.x, R.y.y, R.y.z, R.z.x, R.z.y, R.z.z});
    Vec J(6 * nv);
    jacobian<double>(m, w, q, body, JacobianAxes::body, J);
    note("frame_J_local", J, c.columns(s["frame_J_local"], 6, true));
    jacobian<double>(m, w, q, body, JacobianAxes::world, J);
    note("frame_J_local_world_aligned", J, c.columns(s["frame_J_local_world_aligned"], 6, true));

    // Negative control: a torque off by 1e-9 must be seen.
    Vec off = tau;
    off[nv - 1] += 1e-6 * (1 + std::fabs(off[nv - 1]));
    aba<double>(m, w, q, v, {off, {}}, a);
    EXPECT_GT(relative(a, c.ours(s["aba"])), 1e-12);
  }
  for (const auto& [what, value] : worst) {
    EXPECT_LE(value, 1e-12) << what;
    RecordProperty(what, std::to_string(value));
    std::printf("  %-28s worst %.1e   bound 1e-12\n", what.c_str(), value);
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, Pinocchio,
                         testing::Values("ur5", "panda7", "sat_panda", "hyq", "chain30", "dpend",
                                         "mixed", "mixed_freeflyer", "tiago_continuous"),
                         [](const auto& robot) { return std::string(robot.param); });

}  // namespace
}  // namespace porthos::mechanics::pinocchio_test
