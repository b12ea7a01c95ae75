#include "integrators/derivatives/run_instants.h"

#include <algorithm>

#include "phs/scalars/derivative.h"

namespace porthos::integrators {

RunInstants::RunInstants(const phs::Model& model)
    : run_(dynamic_cast<const RunModel*>(&model)), n_(size_t(model.description().nx)) {
  const auto holds = model.holds();
  if (holds.empty()) return;
  const auto* sampled = dynamic_cast<const phs::WithInstants*>(run_ ? &run_->model() : &model);
  if (sampled) instants_ = sampled->instants();
  if (!run_ || !instants_)
    throw InvalidArgument("a derivative takes no sampled controllers in '" +
                          model.description().name + "', and it has '" + holds.front()->name +
                          "', expected a network of its own");
  for (size_t i = 0; i < holds.size(); ++i) {
    const auto gains = instants_->gains(i);
    const Hold h{memory_.size(), holds[i]->fresh.size(), gains_.size(), gains.size(),
                 instants_->flows(i)};
    for (size_t k = 0; k < holds[i]->values; ++k) values_.push_back(h.at + k);
    memory_.resize(h.at + h.size);
    gains_.insert(gains_.end(), gains.begin(), gains.end());
    holds_.push_back(h);
    holds_.back().jacobian.resize(h.size * columns(h));
  }
  for (const auto& b : model.description().blocks)
    if (b.kind == phs::BlockKind::angle) angles_.push_back(size_t(b.at));
  turns_.resize(angles_.size());
  linear_ = linearise_run<double>(model);
  field_.resize(n_);
  by_flows_.resize(linear_->parameters().size());
}

std::vector<std::string> RunInstants::names(std::vector<std::string> parameters) const {
  parameters.resize(parameters.size() - values());
  for (const auto& gain : gains_) parameters.push_back(gain.name);
  return parameters;
}

void RunInstants::require(const std::vector<std::string>& parameters,
                          const std::string& method) const {
  if (!any()) return;
  if (parameters.size() != linear_->parameters().size())
    throw InvalidArgument("'" + method + "' has no derivatives by what '" +
                          run_->holds().front()->name +
                          "' holds, which is sampled, expected Gauss collocation");
}

void RunInstants::keep(Integrator& method, const phs::State& before,
                       const std::vector<std::int64_t>& turns, std::span<double> to) const {
  auto next = to.begin();
  for (size_t i = 0; i < holds_.size(); ++i)
    *next++ = method.sampler().renews(i, method.time(before), before) ? 1 : 0;
  next = std::ranges::copy(method.sampler().before(), next).out;
  next = std::ranges::copy(method.sampler().memory(), next).out;
  const auto x = next;
  for (size_t k = 0; k < n_; ++k) *next++ = before.x[k] + before.lo[k];
  for (size_t a = 0; a < angles_.size(); ++a)
    x[std::ptrdiff_t(angles_[a])] += double(before.turns[a] - turns[a]) * phs::two_pi_hi;
}

void RunInstants::at(std::span<const double> kept, const std::vector<std::int64_t>& turns,
                     double t) {
  if (!any()) return;
  const auto before = kept.subspan(holds_.size(), memories()),
             after = kept.subspan(holds_.size() + memories(), memories()), x = kept.last(n_);
  std::ranges::copy(before, memory_.begin());
  x_.assign(x.begin(), x.end());
  t_ = t;
  angles_told_.resize(angles_.size());
  for (size_t a = 0; a < angles_.size(); ++a) angles_told_[a] = double(turns[a]) * phs::two_pi_hi;
  turns_.assign(angles_told_.begin(), angles_told_.end());
  instants_->set_turn_angles(turns_);
  linear_->set_turn_angles(angles_told_);
  for (size_t i = 0; i < holds_.size(); ++i) {
    Hold& h = holds_[i];
    std::ranges::copy(after.subspan(h.at, h.size), run_->memories()[i]->begin());
    h.renewed = kept[i] != 0;
    if (h.renewed) differentiate(i);
  }
  linear_->at(t, x_, field_);
}

void RunInstants::differentiate(size_t i) {
  Hold& h = holds_[i];
  const auto memory = std::span<const double>(memory_).subspan(h.at, h.size);
  seeds_.assign(x_.begin(), x_.end());
  seeds_.insert(seeds_.end(), memory.begin(), memory.end());
  for (size_t k = 0; k < h.gains; ++k) seeds_.emplace_back(gains_[h.gain + k].value);
  seeds_.resize(columns(h), phs::Dual(0.0));
  const auto seeds = std::span<const phs::Dual>(seeds_);
  phs::along_each(seeds_, [&](size_t j) {
    const auto remembered = seeds.subspan(n_, h.size);
    to_.assign(remembered.begin(), remembered.end());
    instants_->sample(i, seeds.subspan(n_ + h.size, h.gains), phs::Dual(t_), seeds.first(n_),
                      seeds.last(h.flows), to_);
    for (size_t r = 0; r < h.size; ++r) h.jacobian[r * columns(h) + j] = to_[r].d;
  });
}

void RunInstants::back(TwoWords& lambda, TwoWords& parameters, Adjoint& v) {
  if (!any()) return;
  const size_t own = parameters.x.size() - values();
  for (size_t k = 0; k < values(); ++k) {
    v.memory.add(values_[k], parameters.x[own + k]);
    v.memory.add(values_[k], parameters.lo[own + k]);
    parameters.x[own + k] = parameters.lo[own + k] = 0;
  }
  for (size_t i = 0; i < holds_.size(); ++i) {
    const Hold& h = holds_[i];
    if (!h.renewed) continue;
    TwoWords before(h.size);
    weights_.assign(h.flows, 0.0);
    for (size_t r = 0; r < h.size; ++r) {
      const double mu = v.memory.x[h.at + r] + v.memory.lo[h.at + r];
      const double* slope = h.jacobian.data() + r * columns(h);
      if (mu == 0) continue;
      for (size_t k = 0; k < n_; ++k) lambda.add(k, *slope++ * mu);
      for (size_t k = 0; k < h.size; ++k) before.add(k, *slope++ * mu);
      for (size_t k = 0; k < h.gains; ++k) v.gains.add(h.gain + k, *slope++ * mu);
      for (size_t k = 0; k < h.flows; ++k) weights_[k] += *slope++ * mu;
    }
    std::ranges::fill(by_flows_, 0.0);
    linear_->add_flow_gradient(i, weights_, by_flows_);
    for (size_t k = 0; k < own; ++k) parameters.add(k, by_flows_[k]);
    std::ranges::copy(before.x, v.memory.x.begin() + std::ptrdiff_t(h.at));
    std::ranges::copy(before.lo, v.memory.lo.begin() + std::ptrdiff_t(h.at));
  }
}

void RunInstants::forwards(std::span<const double> dx, std::span<double> dm) const {
  for (const Hold& h : holds_) {
    if (!h.renewed) continue;
    std::vector<double> after(h.size, 0.0);
    for (size_t r = 0; r < h.size; ++r) {
      const double* slope = h.jacobian.data() + r * columns(h);
      for (size_t k = 0; k < n_; ++k) after[r] += *slope++ * dx[k];
      for (size_t k = 0; k < h.size; ++k) after[r] += *slope++ * dm[h.at + k];
    }
    std::ranges::copy(after, dm.begin() + std::ptrdiff_t(h.at));
  }
}

void RunInstants::add_difference(phs::System<double>& up, phs::System<double>& down,
                                 double distance, std::span<double> dm) const {
  for (size_t i = 0; i < holds_.size(); ++i) {
    const Hold& h = holds_[i];
    if (!h.renewed) continue;
    const auto memory = std::span<const double>(memory_).subspan(h.at, h.size);
    std::vector<double> above(memory.begin(), memory.end()), below(above);
    up.sample(i, t_, x_, above);
    down.sample(i, t_, x_, below);
    for (size_t r = 0; r < h.size; ++r)
      if (above[r] != below[r]) dm[h.at + r] += (above[r] - below[r]) / (2 * distance);
  }
}

void RunInstants::held(std::span<const double> dm, std::span<double> dw) const {
  for (size_t k = 0; k < values(); ++k) dw[k] = dm[values_[k]];
}

std::vector<phs::LawGain> gains_of_run(const phs::Model& model) {
  const OfRun run(model);
  return RunInstants(*run.model).gains();
}

}  // namespace porthos::integrators
