#include "scene/run/fast_swings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mechanics/hamiltonian_field.h"
#include "scene/assemble/assembly.h"
#include "scene/run/limit_notes.h"
#include "scene/run/run_report.h"

namespace porthos::scene {
namespace {

constexpr int most_records = 4000, least_records = 20;
/// Of a sine with m records a swing |sin(π/m) m/π - cos(π/m)| of its path is off on average: a
/// quarter at 3.5, which a line through the records no longer shows. Impacts and feet that land are
/// off by 0.1 to 0.2 at records that show their swings, as 5 a swing are.
constexpr double most_off = 0.25;
constexpr double least_path = 1e-6;  ///< [rad, m]; less is no motion

}  // namespace

bool FastSwings::Joint::swings() const { return path > least_path && off > most_off * path; }

FastSwings::FastSwings(const Assembly& assembly, const RecordLayout& layout)
    : assembly_(assembly), layout_(layout), turns_(layout.turns) {
  if (!assembly.mechanical) return;
  size_t angle = 0;
  for (const auto& c : assembly.mechanical->mechanism().coordinates()) {
    Joint joint{c.joint, size_t(c.q), size_t(c.v), {}};
    if (c.kind == phs::BlockKind::angle) joint.turn = angle++;
    if (c.nq == 1 && c.nv == 1) joints_.push_back(std::move(joint));
  }
  if (any()) workspace_.emplace(assembly.mechanical->mechanism());
}

void FastSwings::see(std::span<const double> record) {
  if (!any() || seen_ == most_records) return;
  const auto& m = assembly_.mechanical->mechanism();
  const size_t nq = size_t(m.nq());
  const auto x = record.subspan(layout_.x(), layout_.nx);
  const double t = record[layout_.time()], h = t - before_;
  turns_of(layout_, record, turns_);
  workspace_->set_turns(turns_);
  mechanics::rates_from_momenta<double>(m, *workspace_, x.first(nq), x.subspan(nq, nq));
  for (Joint& j : joints_) {
    const double q = x[j.q] + (j.turn ? phs::two_pi_hi * double(turns_[*j.turn]) : 0);
    const double v = workspace_->rate[j.v];
    if (seen_ > 0) {
      j.path += 0.5 * h * (std::fabs(v) + std::fabs(j.rate));
      j.off += std::fabs(q - j.position - 0.5 * h * (v + j.rate));
    }
    j.position = q;
    j.rate = v;
  }
  if (seen_++ > 0) apart_ = std::max(apart_, h);
  before_ = t;
}

void FastSwings::fill(RunReport& report) const {
  if (seen_ < least_records) return;
  std::string names;
  size_t count = 0;
  for (const Joint& j : joints_)
    if (j.swings() && ++count <= most_told)
      names += fmt::format("{}'{}'", names.empty() ? "" : ", ", j.name);
  if (count == 0) return;
  if (count > most_told) names += fmt::format(" and {} more", count - most_told);
  const bool each_step = apart_ < 1.5 * report.step_s;
  report.notes.push_back(fmt::format(
      "records every {:.4g} s are too far apart for the swings of {}, whose pictures and films "
      "mislead: take {}",
      apart_, names,
      each_step                 ? "a smaller step, which is recorded each time"
      : layout_.watched.empty() ? "a smaller record_every"
                                : "a smaller record_every; the least and largest are in minimum/ "
                                  "and maximum/"));
}

}  // namespace porthos::scene
