#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "integrators/core/stage_lanes.h"
#include "phs/system/linearised.h"
#include "planning/dynamics.h"

namespace porthos::planning {
namespace {

constexpr int V = integrators::stage_lanes;
using Lanes = phs::Pack<double, V>;

/// Numbers lane by lane: each of the nx entries has V lanes.
class ModelDynamics final : public Dynamics {
  using Inputs = std::vector<phs::Linearised<Lanes>::Plain>;

 public:
  ModelDynamics(std::shared_ptr<const phs::Model> model, Inputs inputs)
      : Dynamics(model->description().nx, int(inputs.size())),
        model_(std::move(model)),
        inputs_(std::move(inputs)),
        system_(model_->instantiate<Lanes>()),
        linear_(phs::linearise<Lanes>(*model_)),
        n_(size_t(nx())),
        m_(size_t(nu())),
        x_(n_),
        f_(n_),
        v_(n_),
        other_(n_) {}

  void field(In t, In x, In u, Out f) override {
    for (size_t p = 0; p < t.size(); p += V) {
      const Lanes time = gather(t, x, p, 1);
      system_->field(time, x_, {}, f_);
      scatter_field(p, t.size(), u, f);
    }
  }

  /// Every lane has a stage and a direction: with few stages, several columns come at once.
  void jacobian(In t, In x, In u, Out f, Out J) override {
    const size_t count = t.size(), z = n_ + m_;
    std::fill(J.begin(), J.end(), 0.0);
    const size_t side = std::max<size_t>(1, V / count);  // directions side by side
    for (size_t p = 0; p < count; p += V / side) {
      const Lanes time = gather(t, x, p, side);
      linear_->at(time, x_, f_);
      if (side == 1)
        scatter_field(p, count, u, f);
      else
        for (size_t i = 0; i < count; ++i) take_field(i, i * side, u, f);
      for (size_t k = 0; k < n_; k += side) {
        std::fill(v_.begin(), v_.end(), Lanes(0.0));
        for (size_t l = 0; l < V; ++l)
          if (k + l % side < n_) v_[k + l % side].set(int(l), 1.0);
        linear_->times(v_, other_);
        for (size_t l = 0; l < V; ++l) {
          const size_t point = p + l / side, column = k + l % side;
          if (point >= count || column >= n_) continue;
          for (size_t i = 0; i < n_; ++i) J[(point * z + column) * n_ + i] = other_[i][int(l)];
        }
      }
    }
    for (size_t p = 0; p < count; ++p)
      for (size_t a = 0; a < m_; ++a) J[(p * z + n_ + a) * n_ + size_t(inputs_[a].momentum)] = 1;
  }

  /// (Dfᵀ(x + e) - Dfᵀ(x - e)) λ / 2|e|; lanes are pairs of opposite directions and stages.
  void hessian(In t, In x, In, In lambda, Out H) override {
    const size_t count = t.size(), z = n_ + m_, all = count * n_;
    std::fill(H.begin(), H.end(), 0.0);
    constexpr size_t pairs = V / 2;
    for (size_t first = 0; first < all; first += pairs) {
      Lanes time(0.0);
      double width[pairs];
      for (size_t l = 0; l < V; ++l) {
        const size_t which = std::min(first + l / 2, all - 1), p = which / n_, k = which % n_;
        time.set(int(l), t[p]);
        for (size_t i = 0; i < n_; ++i) {
          x_[i].set(int(l), x[p * n_ + i]);
          v_[i].set(int(l), lambda[p * n_ + i]);
        }
        const double e = 6e-6 * std::max(1.0, std::fabs(x[p * n_ + k])),
                     there = x[p * n_ + k] + (l % 2 ? e : -e);
        x_[k].set(int(l), there);
        if (l % 2) width[l / 2] = there - x_[k][int(l) - 1];
      }
      linear_->at(time, x_, f_);
      linear_->transpose_times(v_, other_);
      for (size_t j = 0; j < pairs && first + j < all; ++j) {
        const size_t p = (first + j) / n_, k = (first + j) % n_;
        for (size_t i = 0; i < n_; ++i)
          H[(p * z + k) * z + i] = (other_[i][int(2 * j + 1)] - other_[i][int(2 * j)]) / width[j];
      }
    }
    for (size_t p = 0; p < count; ++p)
      for (size_t a = 0; a < n_; ++a)
        for (size_t b = 0; b < a; ++b) {
          double &one = H[(p * z + a) * z + b], &two = H[(p * z + b) * z + a];
          one = two = 0.5 * (one + two);
        }
  }

 private:
  /// The points from p on into lanes, each in `side` lanes; the last one fills up.
  Lanes gather(In t, In x, size_t p, size_t side) {
    Lanes time(0.0);
    for (size_t l = 0; l < V; ++l) {
      const size_t point = std::min(p + l / side, t.size() - 1);
      time.set(int(l), t[point]);
      for (size_t i = 0; i < n_; ++i) x_[i].set(int(l), x[point * n_ + i]);
    }
    return time;
  }
  void take_field(size_t point, size_t lane, In u, Out f) const {
    for (size_t i = 0; i < n_; ++i) f[point * n_ + i] = f_[i][int(lane)];
    for (size_t a = 0; a < m_; ++a)
      f[point * n_ + size_t(inputs_[a].momentum)] += u[point * m_ + a];
  }
  void scatter_field(size_t p, size_t count, In u, Out f) const {
    for (size_t l = 0; l < V && p + l < count; ++l) take_field(p + l, l, u, f);
  }

  std::shared_ptr<const phs::Model> model_;
  Inputs inputs_;
  std::unique_ptr<phs::System<Lanes>> system_;
  std::unique_ptr<phs::Linearised<Lanes>> linear_;
  size_t n_, m_;
  std::vector<Lanes> x_, f_, v_, other_;
};

}  // namespace

std::unique_ptr<Dynamics> dynamics_of(std::shared_ptr<const phs::Model> model,
                                      const std::vector<std::string>& ports) {
  const auto& d = model->description();
  const auto linear = phs::linearise<Lanes>(*model);
  std::vector<phs::Linearised<Lanes>::Plain> inputs;
  for (const auto& name : ports) {
    const auto port =
        std::find_if(d.ports.begin(), d.ports.end(), [&](const auto& p) { return p.name == name; });
    if (port == d.ports.end())
      throw InvalidArgument(fmt::format("'{}' has no port '{}', expected one of: {}", d.name, name,
                                        listed(d.ports, [](const auto& p) { return p.name; })));
    if (port->size != 1)
      throw InvalidArgument(
          fmt::format("port '{}' has {} numbers, expected one: a torque or a "
                      "force at a joint of one degree of freedom",
                      name, port->size));
    inputs.push_back(linear->input(port->at));
    if (inputs.back().momentum < 0)
      throw InvalidArgument(fmt::format(
          "the input of port '{}' does not just add to one momentum, expected the torque or force "
          "of a joint in a system without controllers",
          name));
  }
  return std::make_unique<ModelDynamics>(std::move(model), std::move(inputs));
}

}  // namespace porthos::planning
