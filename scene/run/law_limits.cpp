#include "scene/run/law_limits.h"

#include <fmt/format.h>

#include <cmath>

#include "phs/network/network.h"
#include "scene/assemble/assembly.h"
#include "scene/run/run_report.h"

namespace porthos::scene {

void LawLimits::Count::add(double time) {
  if (records++ == 0) first = time;
}

LawLimits::LawLimits(const Assembly& assembly, const RecordLayout& layout)
    : layout_(layout), turns_(layout.turns) {
  const auto size = [](const phs::Model& m) { return size_t(m.description().nx); };
  for (const auto& [controller, l] : assembly.hindered)
    laws_.push_back({fmt::format("controller '{}' at {}", controller, l.port),
                     l.law,
                     l.limit,
                     l.hindrance,
                     0,
                     size(*assembly.mechanical),
                     {},
                     {}});
  if (!assembly.mechanical)
    if (const auto* network = dynamic_cast<const phs::NetworkModel*>(&assembly.internal()))
      for (auto& l : network->limited())
        laws_.push_back({fmt::format("controller '{}'", l.controller),
                         std::move(l.law),
                         l.limit,
                         {},
                         l.at,
                         l.size,
                         {},
                         {}});
  if (!any()) return;
  x_.resize(size(assembly.mechanical ? *assembly.mechanical : *assembly.model));
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
  for (Watched& w : laws_) {
    const auto x = seen_by(w);
    if (const char* why = w.hindered ? w.hindered(x) : nullptr) {
      w.hindrance.add(time);
      w.why = why;
    } else if (w.most < HUGE_VAL) {
      double u = 0;
      (*w.law)(time, x, {}, std::span(&u, 1));
      if (std::fabs(u) >= w.most) w.limit.add(time);
    }
  }
  ++records_;
}

std::string LawLimits::share(const Count& count) const {
  return count.records == records_
             ? "all"
             : fmt::format("{:.2g} % of the", 100.0 * double(count.records) / double(records_));
}

void LawLimits::note(RunReport& report, const std::string& law, const Count& count,
                     const std::string& what) const {
  if (count.records == 0) return;
  report.notes.push_back(
      fmt::format("{} {} at {} records, first at {:.6g} s: its certificate does not hold there",
                  law, what, share(count), count.first));
}

void LawLimits::fill(RunReport& report) const {
  for (const Watched& w : laws_) {
    note(report, w.name, w.limit, fmt::format("asks for more than its limit of {:.4g}", w.most));
    note(report, w.name, w.hindrance, w.why ? w.why : "");
    if (report.outcome == integrators::Outcome::failed && !report.trouble.empty() &&
        w.limit.records > 0 && !w.law->hindrance(seen_by(w)).empty())
      report.trouble +=
          fmt::format("; it was at its limit of {:.4g} at {} records: a larger one first", w.most,
                      share(w.limit));
  }
}

}  // namespace porthos::scene
