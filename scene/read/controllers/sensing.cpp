#include "scene/read/controllers/sensing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>

#include "ensemble/random.h"
#include "mechanics/mechanical_model.h"
#include "scene/read/schema_keys-inl.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

double to_grid(double x, double resolution) {
  return resolution > 0 ? resolution * std::round(x / resolution) : x;
}

class Sensed final : public phs::SampledLaw {
  struct Joint {
    size_t q, v;
    std::uint64_t position_stream, rate_stream;
    bool attitude;
  };

 public:
  Sensed(phs::SampledLawPtr law, const Sensing& how, double period, size_t ports,
         const std::vector<MeasuredJoint>& joints, const NoiseKey& key,
         std::shared_ptr<const mechanics::MechanicalModel> model, bool of_state)
      : law_(std::move(law)),
        how_(how),
        period_(period),
        fresh_(law_->fresh()),
        queue_(size_t(how.delay) * ports),
        model_(std::move(model)),
        of_state_(of_state) {
    fresh_.resize(fresh_.size() + queue_, 0.0);
    const std::string of = fmt::format("{}, case {}, ", key.controller, key.of_case);
    for (const MeasuredJoint& j : joints)
      joints_.push_back({j.q, j.v, ensemble::name_bits(of + "position of " + j.name),
                         ensemble::name_bits(of + "rate of " + j.name), j.attitude});
  }

  std::vector<double> fresh() const override { return fresh_; }
  std::vector<phs::Shown> shown() const override { return law_->shown(); }
  std::vector<std::string> stories(std::span<const double> memory) const override {
    return law_->stories(memory.first(memory.size() - queue_));
  }

  void operator()(double t, std::span<const double> x, std::span<const double> y,
                  std::span<double> memory, std::span<double> u) const override {
    const auto own = memory.first(memory.size() - queue_);
    const auto state = x.first(size_t(model_->description().nx));
    if (!how_.measures()) {
      (*law_)(t, x, y, own, u);
    } else if (of_state_) {
      std::vector<double> q(state.begin(), state.begin() + model_->mechanism().nq());
      auto v = model_->rates(state);
      for (const Joint& j : joints_)
        j.attitude ? measure_attitude(j, t, &q[j.q], &v[j.v]) : measure(j, t, q[j.q], v[j.v]);
      (*law_)(t, model_->state(q, v), y, own, u);
    } else {
      std::vector<double> seen(state.begin(), state.end()), v(y.begin(), y.end());
      for (const Joint& j : joints_) {
        seen.push_back(x[j.q]);
        measure(j, t, seen.back(), v[j.v]);
      }
      (*law_)(t, seen, v, own, u);
    }
    for (double& each : u) each = to_grid(each, how_.torque_resolution);
    if (queue_ == 0) return;
    const auto queue = memory.last(queue_);  // the oldest first
    std::swap_ranges(u.begin(), u.end(), queue.begin());
    std::rotate(queue.begin(), queue.begin() + long(u.size()), queue.end());
  }

 private:
  std::uint64_t instant(double t) const { return std::uint64_t(std::llround(t / period_)); }
  void measure(const Joint& j, double t, double& q, double& v) const {
    const auto noise = [&](std::uint64_t stream, double deviation) {
      return deviation > 0 ? deviation * ensemble::Stream(how_.seed, stream, instant(t)).normal()
                           : 0;
    };
    q = to_grid(q + noise(j.position_stream, how_.position_noise), how_.position_resolution);
    v = to_grid(v + noise(j.rate_stream, how_.rate_noise), how_.rate_resolution);
  }

  /// A small turn about the axes of the body, and an angular velocity in them.
  void measure_attitude(const Joint& j, double t, double* q, double* v) const {
    if (how_.attitude_noise > 0) {
      ensemble::Stream random(how_.seed, j.position_stream, instant(t));
      double turn[3];
      for (double& each : turn) each = how_.attitude_noise * random.normal();
      const double angle = std::hypot(turn[0], turn[1], turn[2]);
      const double s = angle > 0 ? std::sin(angle / 2) / angle : 0.5;
      const mechanics::Quaternion<double> small{std::cos(angle / 2),
                                                {s * turn[0], s * turn[1], s * turn[2]}};
      (mechanics::Quaternion<double>::load(q) * small).store(q);
    }
    if (how_.angular_velocity_noise > 0) {
      ensemble::Stream random(how_.seed, j.rate_stream, instant(t));
      for (int k = 0; k < 3; ++k) v[k] += how_.angular_velocity_noise * random.normal();
    }
  }

  const phs::SampledLawPtr law_;
  const Sensing how_;
  const double period_;
  std::vector<double> fresh_;
  const size_t queue_;  ///< numbers of the memory that wait for their time
  std::vector<Joint> joints_;
  const std::shared_ptr<const mechanics::MechanicalModel> model_;
  const bool of_state_;
};

class SampledPortLaws final : public phs::SampledLaw {
 public:
  SampledPortLaws(std::vector<energy_shaping::PortLaw> laws,
                  std::shared_ptr<const mechanics::MechanicalModel> model)
      : laws_(std::move(laws)),
        model_(std::move(model)),
        system_(model_->instantiate<double>()),
        nx_(size_t(model_->description().nx)),
        e_(nx_),
        y_(size_t(model_->description().nu)) {
    for (const auto& l : laws_)
      ports_.push_back(find_named(model_->description().ports, l.port, "there is no port"));
  }

  std::vector<double> fresh() const override { return {}; }

  void operator()(double t, std::span<const double> x, std::span<const double>, std::span<double>,
                  std::span<double> u) const override {
    const std::lock_guard lock(mutex_);
    const auto own = x.first(nx_);
    system_->gradient(own, e_);
    system_->output(own, e_, y_);
    for (size_t k = 0; k < laws_.size(); ++k) {
      const auto n = size_t(ports_[k].size);
      (*laws_[k].law)(t, own, std::span<const double>(y_).subspan(size_t(ports_[k].at), n),
                      u.first(n));
      u = u.subspan(n);
    }
  }

 private:
  const std::vector<energy_shaping::PortLaw> laws_;
  const std::shared_ptr<const mechanics::MechanicalModel> model_;
  std::vector<phs::Port> ports_;
  mutable std::mutex mutex_;  // of the three
  const std::unique_ptr<phs::System<double>> system_;
  const size_t nx_;
  mutable std::vector<double> e_, y_;
};

}  // namespace

std::vector<SchemaKey> sensing_keys() {
  using namespace keys;
  return {
      whole("delay", "0", "periods from a measurement to the torque made from it"),
      table("resolution", "sensing.resolution", "exact", "of what is measured and of the torques"),
      table("noise", "sensing.noise", "none", "of what is measured")};
}

std::vector<SchemaTable> sensing_tables() {
  using namespace keys;
  return {{"sensing.resolution",
           "[controller.resolution]",
           "A sampled controller gets and gives the nearest multiples of these numbers.",
           {number("position", "rad (m)", "0", "of the joints of one degree of freedom"),
            number("rate", "rad/s (m/s)", "0", "likewise"),
            number("torque", "N m (N)", "0", "of what it gives")}},
          {"sensing.noise",
           "[controller.noise]",
           "Normal noise of what a sampled controller measures: standard deviations.",
           {number("position", "rad (m)", "0", "of the joints of one degree of freedom"),
            number("rate", "rad/s (m/s)", "0", "likewise"),
            number("attitude", "rad", "0", "of the base and ball joints, about each axis"),
            number("angular_velocity", "rad/s", "0", "likewise, in the axes of the body"),
            whole("seed", "1", "the same seed gives the same noise")}}};
}

Sensing read_sensing(const Table& t) {
  Sensing s;
  for (const char* key : {"delay", "resolution", "noise"})
    if (t.has(key) && !t.has("rate"))
      t.fail(key, "is given without a rate, expected both: what is continuous has no instants");
  const auto delay = t.whole("delay");
  if (delay > 1000) t.fail("delay", fmt::format("is {}, expected at most 1000 periods", delay));
  s.delay = int(delay);
  if (t.has("resolution")) {
    const Table r = t.table("resolution");
    s.position_resolution = r.not_negative("position");
    s.rate_resolution = r.not_negative("rate");
    s.torque_resolution = r.not_negative("torque");
  }
  if (t.has("noise")) {
    const Table n = t.table("noise");
    s.position_noise = n.not_negative("position");
    s.rate_noise = n.not_negative("rate");
    s.attitude_noise = n.not_negative("attitude");
    s.angular_velocity_noise = n.not_negative("angular_velocity");
    s.seed = n.whole("seed");
  }
  return s;
}

phs::SampledLawPtr sensed(phs::SampledLawPtr law, const Sensing& how, double period, size_t ports,
                          std::vector<MeasuredJoint> joints, NoiseKey key,
                          std::shared_ptr<const mechanics::MechanicalModel> model, bool of_state) {
  return std::make_shared<Sensed>(std::move(law), how, period, ports, joints, key, std::move(model),
                                  of_state);
}

phs::SampledLawPtr sampled_port_laws(std::vector<energy_shaping::PortLaw> laws,
                                     std::shared_ptr<const mechanics::MechanicalModel> model) {
  return std::make_shared<SampledPortLaws>(std::move(laws), std::move(model));
}

}  // namespace porthos::scene
