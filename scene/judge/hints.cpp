// What a trajectory that does not pass would be with columns in another unit or order.
#include "scene/judge/detail/hints.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "phs/system/energy_scale.h"
#include "scene/run/ledger.h"

namespace porthos::scene {
namespace {

/// The largest error of the energy, relative.
double error_of(Trajectory one, const Rows& rows, const phs::Description& d, Meter& meter,
                bool centre_out) {
  Ledger ledger(d);
  phs::EnergyScale scale(d);
  Numbers works(d.powers.size());
  double first = 0, most = 0;
  for (size_t i = 0; i < rows.t.size(); ++i) {
    const auto s = one.row(d, i, i > 0 ? rows.interval(i) : 0, centre_out).inner;
    if (i > 0) {
      one.works(rows.t, i, works);
      ledger.book(works);
    }
    const Measured& m = meter.measure(rows.t[i], s);
    if (!m.finite()) return INFINITY;
    scale.see(m.stored_J);
    const double error = ledger.look(m);
    if (i == 0) first = error;
    most = std::max(most, std::fabs(error - first));
  }
  return scale.value() > 0 ? most / scale.value() : INFINITY;
}

}  // namespace

void ask_about_columns(RunReport& r, const Trajectory& trajectory, const Rows& rows,
                       const phs::Description& d, Meter& meter, bool centre_out) {
  constexpr double clearly = 0.1;
  constexpr size_t most_joints = 8;
  if (!trajectory.has_rates() || d.powers.size() != trajectory.torques().size()) return;
  double best = clearly * r.energy.max_rel_error;
  std::string question;
  const auto ask = [&](const Trajectory& other, const std::string& text) {
    const double error = error_of(other, rows, d, meter, centre_out);
    if (!(error < best)) return;
    best = error;
    question = text;
  };
  ask(trajectory.in_degrees(), "are angles and rates in degrees? expected radians");
  const auto& joints = trajectory.joints();
  for (size_t b = 0; joints.size() <= most_joints && b < joints.size(); ++b)
    for (size_t a = 0; a < b; ++a)
      for (const auto& [what, q, v] :
           {std::tuple{"columns", true, true}, {"positions", true, false}, {"rates", false, true}})
        ask(trajectory.exchanged(joints[a], joints[b], q, v),
            fmt::format("are the {} of '{}' and '{}' in each other's place?", what, joints[a],
                        joints[b]));
  if (!question.empty())
    r.notes.push_back(
        fmt::format("{} The error of the energy would be {:.2g} relative in place of "
                    "{:.2g}",
                    question, best, r.energy.max_rel_error));
}

}  // namespace porthos::scene
