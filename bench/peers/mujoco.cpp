// MuJoCo (Todorov, Erez, Tassa 2012) as packaged: only the smooth dynamics, no contacts, limits or
// sensors.
#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "bench/peers/subject.h"

namespace porthos::bench {
namespace {

struct MujocoRun {
  std::unique_ptr<mjModel, void (*)(mjModel*)> model{nullptr, mj_deleteModel};
  std::unique_ptr<mjData, void (*)(mjData*)> data{nullptr, mj_deleteData};
  std::vector<Eigen::VectorXd> q, v, tau, a;
  Eigen::VectorXd out;

  void place(int i) {
    Eigen::Map<Eigen::VectorXd>(data->qpos, model->nq) = q[size_t(i)];
    mj_kinematics(model.get(), data.get());
    mj_comPos(model.get(), data.get());
  }
  void crba(int i) {
    place(i);
    mj_crb(model.get(), data.get());
  }
  void rnea(int i) {
    place(i);
    Eigen::Map<Eigen::VectorXd>(data->qvel, model->nv) = v[size_t(i)];
    Eigen::Map<Eigen::VectorXd>(data->qacc, model->nv) = a[size_t(i)];
    mj_comVel(model.get(), data.get());
    mj_rne(model.get(), data.get(), 1, out.data());
  }
  /// MuJoCo has no ABA: composite inertias, a sparse factorisation and one solve.
  void aba(int i) {
    crba(i);
    mj_factorM(model.get(), data.get());
    Eigen::Map<Eigen::VectorXd>(data->qvel, model->nv) = v[size_t(i)];
    mj_comVel(model.get(), data.get());
    mj_rne(model.get(), data.get(), 0, data->qfrc_bias);
    Eigen::Map<Eigen::VectorXd> f(data->qfrc_smooth, model->nv);
    f = tau[size_t(i)] - Eigen::Map<Eigen::VectorXd>(data->qfrc_bias, model->nv);
    mj_solveM(model.get(), data.get(), out.data(), data->qfrc_smooth, 1);
  }
};

/// Body i and what hangs on it, in MuJoCo's XML.
std::string body(const mechanics::Mechanism& m, int i) {
  const PeerBody b = peer_body(m, i);
  const Eigen::Quaterniond r(b.R);
  const auto& I = b.inertia_at_com;
  std::string s =
      fmt::format(R"(<body pos="{:.17g} {:.17g} {:.17g}" quat="{:.17g} {:.17g} {:.17g} {:.17g}">)",
                  b.r.x(), b.r.y(), b.r.z(), r.w(), r.x(), r.y(), r.z());
  s += is_joint(m, i, "free")       ? "<freejoint/>"
       : is_joint(m, i, "revolute") ? R"(<joint type="hinge" axis="0 0 1"/>)"
                                    : R"(<joint type="slide" axis="0 0 1"/>)";
  s += fmt::format(
      R"(<inertial pos="{:.17g} {:.17g} {:.17g}" mass="{:.17g}" fullinertia="{:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}"/>)",
      b.com.x(), b.com.y(), b.com.z(), b.mass, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2),
      I(1, 2));
  for (int k = i + 1; k < m.body_count(); ++k)
    if (m.nodes()[size_t(k)].parent == i) s += body(m, k);
  return s + "</body>";
}

}  // namespace

Subject mujoco_subject(const Case& c) {
  const mechanics::Mechanism& m = *c.model;
  const Convention convention{.world_linear = true};
  const auto& g = m.gravity();
  std::string xml = fmt::format(
      R"(<mujoco><compiler boundmass="1e-9" boundinertia="1e-12" balanceinertia="true"/><size nconmax="0" njmax="0"/>)"
      R"(<option gravity="{:.17g} {:.17g} {:.17g}"/><worldbody>)",
      g.x, g.y, g.z);
  for (int i = 0; i < m.body_count(); ++i)
    if (m.nodes()[size_t(i)].parent < 0) xml += body(m, i);
  xml += "</worldbody></mujoco>";
  const auto file = std::filesystem::temp_directory_path() / (m.name() + "_porthos_peer.xml");
  if (FILE* f = std::fopen(file.c_str(), "w")) std::fputs(xml.c_str(), f), std::fclose(f);
  char error[500] = "";
  auto r = std::make_shared<MujocoRun>();
  r->model.reset(mj_loadXML(file.c_str(), nullptr, error, sizeof error));
  std::filesystem::remove(file);
  if (!r->model) throw std::runtime_error(m.name() + ": MuJoCo does not take the model: " + error);
  if (r->model->nv != m.nv()) throw std::runtime_error(m.name() + ": MuJoCo's freedoms differ");
  r->data.reset(mj_makeData(r->model.get()));
  r->out = Eigen::VectorXd::Zero(m.nv());
  for (size_t s = 0; s < c.q.size(); ++s) {
    r->q.push_back(Eigen::Map<const Eigen::VectorXd>(c.q[s].data(), m.nq()));
    r->v.push_back(convention.to_peer(m, c.q[s], c.v[s]));
    r->tau.push_back(convention.force_to_peer(m, c.q[s], c.tau[s]));
    r->a.push_back(convention.acceleration_to_peer(m, c.q[s], c.v[s], c.tau[s]));
  }

  Subject s;
  s.name = std::string("MuJoCo ") + mj_versionString();
  s.tolerance = 1e-5;  // it diagonalises inertias to single precision
  s.aba = [r](int i) { r->aba(i); };
  s.rnea = [r](int i) { r->rnea(i); };
  s.crba = [r](int i) { r->crba(i); };
  const auto left = [r] { return Eigen::VectorXd(r->out); };
  convention.add_checks(s, c, left, left, nullptr);
  return s;
}

}  // namespace porthos::bench
