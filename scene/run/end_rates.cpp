#include "scene/run/end_rates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mechanics/hamiltonian_field.h"
#include "scene/assemble/assembly.h"
#include "scene/run/run_report.h"

namespace porthos::scene {
namespace {

enum Entry { told, still, rate, moved, entries };  // of a joint in the memory: steps at which its
// rates are more than rounding, those of them at which it rests, and there the largest rate [/s]
// and the sum of |dq|
constexpr double fewest = 8;  // an oscillation may return to its place in some steps

}  // namespace

EndRates::EndRates(const Assembly& a) {
  if (a.mechanical && !a.model->description().powers.empty()) {
    mechanism_ = &a.mechanical->mechanism();
    size_t turns = 0;
    for (const auto& c : mechanism_->coordinates()) {
      const bool angle = c.kind == phs::BlockKind::angle;
      if (c.nq == 1 && c.nv == 1) {
        joints_.push_back({c.name, size_t(c.q), size_t(c.v), {}});
        if (angle) joints_.back().turn = turns;
      }
      turns += angle;
    }
  }
  if (any()) workspace_.emplace(*mechanism_);
  rates_.resize(joints_.size());
  memory_.resize(entries * joints_.size());
}

/// Leaves the rates in the workspace.
void EndRates::find_rates(const phs::State& s) {
  const size_t nq = size_t(mechanism_->nq());
  workspace_->set_turns(s.turns);
  mechanics::rates_from_momenta<double>(*mechanism_, *workspace_, std::span(s.x).first(nq),
                                        std::span(s.x).subspan(nq, nq));
}

void EndRates::see(const phs::State& before, const phs::State& after, double h) {
  find_rates(before);
  for (size_t k = 0; k < joints_.size(); ++k) rates_[k] = workspace_->rate[joints_[k].v];
  find_rates(after);
  for (size_t k = 0; k < joints_.size(); ++k) {
    const Joint& j = joints_[k];
    double dq = (after.x[j.q] - before.x[j.q]) + (after.lo[j.q] - before.lo[j.q]);
    if (j.turn) dq += phs::two_pi_hi * double(after.turns[*j.turn] - before.turns[*j.turn]);
    // The slower end: a rate that is damped out within the step was one of its beginning.
    const double least = std::fmin(std::fabs(rates_[k]), std::fabs(workspace_->rate[j.v]));
    double* const m = memory_.data() + entries * k;
    if (!(h * least > 1e-8 * (1 + std::fabs(after.x[j.q])))) continue;
    ++m[told];
    if (!(std::fabs(dq) < 0.05 * h * least)) continue;
    ++m[still];
    m[rate] = std::fmax(m[rate], least);
    m[moved] += std::fabs(dq);
  }
}

bool EndRates::rests(size_t k) const {
  const double* const m = memory_.data() + entries * k;
  return m[still] >= fewest && m[still] > 0.25 * m[told];
}

bool EndRates::ring() const {
  for (size_t k = 0; k < joints_.size(); ++k)
    if (rests(k)) return true;
  return false;
}

void EndRates::fill(RunReport& r) const {
  const Joint* worst = nullptr;
  const double* of = nullptr;
  int more = -1;
  for (size_t k = 0; k < joints_.size(); ++k) {
    const double* const m = memory_.data() + entries * k;
    if (!rests(k)) continue;
    ++more;
    if (worst && m[rate] <= of[rate]) continue;
    worst = &joints_[k];
    of = m;
  }
  if (!worst) return;
  const char* unit = worst->turn ? "rad" : "m";
  r.notes.push_back(fmt::format(
      "rates of '{}'{} at the ends of steps are not those of its {}: up to {:.2g} {}/s, while it "
      "moves by {:.2g} {} a step: what damps it is faster than a step, expected a shorter step or "
      "less damping",
      worst->name, more > 0 ? fmt::format(" and {} more", more) : "",
      worst->turn ? "angle" : "position", of[rate], unit, of[moved] / of[still], unit));
}

void EndRates::restore(std::span<const double> memory) {
  require_size("rates at the ends of steps", memory.size(), memory_.size());
  memory_.assign(memory.begin(), memory.end());
}

}  // namespace porthos::scene
