#include "energy_shaping/matching/vtol_on_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "energy_shaping/loop/closed_loop.h"
#include "mechanics/aba.h"
#include "mechanics/crba.h"
#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"

namespace porthos::energy_shaping {
namespace {

using VtolData = std::shared_ptr<const VtolOnModel::Data>;
using mechanics::Vec3d;

/// A vehicle seen as the plant of the design, and the joint forces of the engine.
template <class T>
class VtolView {
 public:
  explicit VtolView(VtolData data)
      : d_(std::move(data)),
        m_(d_->model->mechanism()),
        w_(m_),
        loop_(d_->loop->template loop<T>()) {}

  /// (x, y, θ and their rates), which are the momenta of the design.
  std::span<const T> state(std::span<const T> at) {
    mechanics::rates_from_momenta<T>(m_, w_, at.first(3), at.subspan(3, 3));
    const std::array<size_t, 3> from{d_->x, d_->y, d_->hinge};
    const std::array<double, 3> sign{1, d_->up, d_->turn};
    for (size_t i = 0; i < 3; ++i) {
      x_[i] = T(sign[i]) * (at[from[i]] - T(d_->rest[from[i]]));
      x_[3 + i] = T(sign[i]) * w_.rate[from[i]];
    }
    return x_;
  }
  /// Joint forces of the engine under the law.
  void operator()(T t, std::span<const T> at, std::span<T> tau) {
    state(at);
    std::array<T, 2> u{};
    loop_->law(t, x_, u);
    const T across = T(d_->mass) * u[0], upward = T(d_->mass) * (u[1] + T(d_->design.g));
    mechanics::jacobian<T>(m_, w_, at.first(3), d_->engine, mechanics::JacobianAxes::world,
                           std::span<T>(J_));
    for (T& all : tau) all = T(0.0);
    for (size_t j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k)
        tau[j] = tau[j] + J_[6 * j + 3 + size_t(k)] *
                              (T(d_->across[k]) * across + T(d_->upward[k]) * upward);
  }

 private:
  VtolData d_;
  const mechanics::Mechanism& m_;
  mechanics::Workspace<T> w_;
  std::unique_ptr<LoopSystem<T>> loop_;
  std::array<T, 6> x_{};
  std::array<T, 18> J_{};
};

struct VtolLaw {
  VtolData data;
  template <class T>
  auto evaluator() const {
    return VtolView<T>(data);
  }
};

[[noreturn]] void refuse_vehicle(const std::string& why) {
  throw InvalidArgument("design 'vtol': " + why);
}

}  // namespace

VtolOnModel::VtolOnModel(std::shared_ptr<const mechanics::MechanicalModel> model,
                         const Engine& engine, const std::vector<double>& rest, Vtol d) {
  Data data{std::move(model), rest, d};
  read(engine, rest, data);
  data.loop = vtol(data.design);
  certificate_ = data.loop->certificate();
  data_ = std::make_shared<const Data>(std::move(data));
  check_motion();
  refuse_failure(certificate_);
}

void VtolOnModel::read(const Engine& engine, const std::vector<double>& rest, Data& data) {
  const auto& m = data.model->mechanism();
  phs::refuse_constraints(data.model->description(), "IDA-PBC");
  std::vector<size_t> slides, hinges;
  for (const auto& c : m.coordinates())
    if (c.nq == 1) (c.unit == "rad" ? hinges : slides).push_back(size_t(c.q));
  if (m.nq() != 3 || slides.size() != 2 || hinges.size() != 1)
    refuse_vehicle(
        fmt::format("'{}' has {} slides and {} hinges of one degree of freedom, expected two and "
                    "one and nothing else",
                    data.model->description().name, slides.size(), hinges.size()));
  require_size("rest", rest.size(), 3);
  const auto& body = m.body(engine.link);
  data.engine = {engine.link, body.node, body.pose};
  data.engine.pose.r = body.pose.r + body.pose.R * engine.point;
  data.hinge = hinges[0];

  auto x = rest;
  x.resize(6, 0.0);
  std::vector<double> load(6), M(9), J(18);
  data.model->instantiate<double>()->gradient(x, load);
  const bool first = std::fabs(load[slides[0]]) > std::fabs(load[slides[1]]);
  data.y = slides[first ? 0 : 1];
  data.x = slides[first ? 1 : 0];
  mechanics::Workspace<double> w(m);
  mechanics::crba<double>(m, w, rest, M);
  data.mass = M[4 * data.y];
  data.up = load[data.y] < 0 ? -1 : 1;
  data.design.g = std::fabs(load[data.y]) / data.mass;
  mechanics::jacobian<double>(m, w, rest, data.engine, mechanics::JacobianAxes::world, J);
  const auto column = [&](size_t j, size_t row) {
    return Vec3d{J[6 * j + row], J[6 * j + row + 1], J[6 * j + row + 2]};
  };
  data.across = column(data.x, 3);
  data.upward = data.up * column(data.y, 3);
  data.turn = dot(column(data.hinge, 0), cross(data.across, data.upward)) < 0 ? -1 : 1;
  const double h = data.turn * dot(column(data.hinge, 3), data.across);
  if (!(h > 1e-9))
    refuse_vehicle(
        fmt::format("the engine is {:.6g} m below the hinge of '{}', expected it below: "
                    "its force across turns the vehicle",
                    h, engine.link));
  data.design.epsilon = M[4 * data.hinge] / (data.mass * h);
}

/// The accelerations of the model under the law against those of the design's plant.
void VtolOnModel::check_motion() {
  const Data& d = *data_;
  const auto& m = d.model->mechanism();
  mechanics::Workspace<double> w(m);
  VtolView<double> law(data_);
  const auto plant = d.loop->plant().instantiate<double>();
  const auto loop = d.loop->loop<double>();
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  double worst = 0, scale = 1e-300;
  std::vector<double> where, tau(size_t(d.model->description().nu)), a(3), rate(6);
  for (int sample = 0; sample < 300; ++sample) {
    std::vector<double> q(3), v(3);
    for (size_t i = 0; i < 3; ++i) {
      q[i] = d.rest[i] + (i == d.hinge ? 3 : 10) * uniform(generator);
      v[i] = 2 * uniform(generator);
    }
    const auto x = d.model->state(q, v);
    law(0.0, std::span<const double>(x), std::span<double>(tau));
    // with the model's own friction and springs, which the design does not have
    auto joint_forces = std::vector<double>(tau.begin(), tau.begin() + 3);
    for (const auto& j : m.joint_properties())
      joint_forces[size_t(j.v)] -=
          j.damping * v[size_t(j.v)] + j.stiffness * (q[size_t(j.q)] - j.rest);
    mechanics::aba<double>(m, w, q, v, {joint_forces, {}}, a);
    const auto y = law.state(x);
    std::array<double, 2> u{};
    loop->law(0.0, y, u);
    plant->field(0.0, y, u, rate);
    const std::array<double, 3> moved{a[d.x], d.up * a[d.y], d.turn * a[d.hinge]};
    for (size_t i = 0; i < 3; ++i) {
      scale = std::max(scale, std::fabs(rate[3 + i]));
      const double off = std::fabs(moved[i] - rate[3 + i]);
      if (off <= worst) continue;
      worst = std::isnan(off) ? HUGE_VAL : off;
      where = q;
    }
  }
  certificate_.report("epsilon", d.design.epsilon,
                      "J/(m h) of the vehicle [m]; its mass [kg] and gravity [m/s²]",
                      {d.mass, d.design.g});
  certificate_.at_most("moves as the design's plant", worst / scale, 1e-9,
                       "accelerations of the model under the law, over the largest, at 300 states",
                       where);
}

std::vector<PortLaw> VtolOnModel::port_laws() const {
  return energy_shaping::port_laws(VtolLaw{data_}, data_->model->description(), {0, 1, 2});
}

}  // namespace porthos::energy_shaping
