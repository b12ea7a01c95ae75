#include "scene/run/law_limits.h"

#include <fmt/format.h>

#include <cmath>

#include "scene/assemble/assembly.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

void LawLimits::Count::add(double time) {
  if (records++ == 0) first = time;
}

LawLimits::LawLimits(const Assembly& assembly, const RecordLayout& layout)
    : assembly_(assembly), layout_(layout), laws_(assembly.hindered.size()), turns_(layout.turns) {
  if (!any()) return;
  x_.resize(size_t(assembly.mechanical->description().nx));
  for (const auto& b : assembly.model->description().blocks)
    if (b.kind == phs::BlockKind::angle) angles_.push_back(size_t(b.at));
}

void LawLimits::see(std::span<const double> record) {
  if (!any()) return;
  const double time = record[layout_.time()];
  turns_of(layout_, record, turns_);
  for (size_t i = 0; i < x_.size(); ++i) x_[i] = record[layout_.x() + i];
  for (size_t k = 0; k < angles_.size(); ++k)
    if (angles_[k] < x_.size()) x_[angles_[k]] += phs::two_pi_hi * double(turns_[k]);
  for (size_t k = 0; k < laws_.size(); ++k) {
    const energy_shaping::PortLaw& l = assembly_.hindered[k].law;
    Watched& w = laws_[k];
    if (const char* why = l.hindrance ? l.hindrance(x_) : nullptr) {
      w.hindrance.add(time);
      w.why = why;
    } else if (l.limit < HUGE_VAL) {
      double u = 0;
      (*l.law)(time, std::span<const double>(x_), {}, std::span(&u, 1));
      if (std::fabs(u) >= l.limit) w.limit.add(time);
    }
  }
  ++records_;
}

void LawLimits::note(RunReport& report, const std::string& law, const Count& count,
                     const std::string& what) const {
  if (count.records == 0) return;
  report.notes.push_back(fmt::format(
      "{} {} at {} records, first at {:.6g} s: its certificate does not hold there", law, what,
      count.records == records_
          ? "all"
          : fmt::format("{:.2g} % of the", 100.0 * double(count.records) / double(records_)),
      count.first));
}

void LawLimits::fill(RunReport& report) const {
  for (size_t k = 0; k < laws_.size(); ++k) {
    const auto& [controller, law] = assembly_.hindered[k];
    const std::string name = fmt::format("controller '{}' at {}", controller, law.port);
    note(report, name, laws_[k].limit,
         fmt::format("asks for more than its limit of {:.4g}", law.limit));
    note(report, name, laws_[k].hindrance, laws_[k].why ? laws_[k].why : "");
  }
}

}  // namespace porthos::scene
