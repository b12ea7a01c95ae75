#include "scene/run/whole_notes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace porthos::scene {
namespace {

constexpr int most_starts = 3;  // told of one kind

bool newton_matters(const RunReport& r) {
  return r.outcome != integrators::Outcome::ok ||
         double(r.cost.factorisations) > least_newton * double(r.cost.steps);
}

/// A note without its numbers; those of names belong to the kind.
std::string kind_of(const std::string& note) {
  std::string kind;
  bool quoted = false;
  const auto of_number = [](unsigned char c) { return std::isdigit(c) || c == '.' || c == '-'; };
  for (size_t i = 0; i < note.size(); ++i) {
    const auto c = static_cast<unsigned char>(note[i]);
    if (c == '\'') quoted = !quoted;
    const auto before = static_cast<unsigned char>(kind.empty() ? ' ' : kind.back());
    if (quoted || !std::isdigit(c) || std::isalnum(before) || before == '_') {
      kind += note[i];
      continue;
    }
    while (i + 1 < note.size() && (of_number(static_cast<unsigned char>(note[i + 1])) ||
                                   (note[i + 1] == 'e' && i + 2 < note.size() &&
                                    of_number(static_cast<unsigned char>(note[i + 2])))))
      ++i;
    kind += '#';
  }
  return kind;
}

}  // namespace

void note_delivered(RunReport& r) {
  const double least = std::max(least_delivered * r.turned_over_J, 1e-12 * r.energy.scale_J);
  std::string givers;
  for (const auto& [name, joule] : r.delivered)
    if (joule > least) add_to_list(givers, fmt::format("'{}' up to {:.3g} J", name, joule));
  if (givers.empty()) return;
  r.delivered_note = std::int16_t(r.notes.size());
  r.notes.push_back(fmt::format(
      "net energy delivered by controllers: {}: not passive unless stored at the start", givers));
}

void note_newton(RunReport& r, const std::string& remark) {
  if (!newton_matters(r)) return;
  r.newton_note = std::int16_t(r.notes.size());
  r.notes.push_back("fixed-point iteration did not suffice for all equations: " + remark);
}

void PhaseNotes::add(RunReport& whole, const RunReport& phase, double from) {
  for (size_t i = 0; i < phase.notes.size(); ++i) {
    const std::string& n = phase.notes[i];
    if (long(i) == phase.delivered_note) continue;
    if (long(i) == phase.newton_note) {
      if (newton_.empty()) newton_ = fmt::format("from {:g} s: {}", from, n);
      continue;
    }
    const auto [known, first] = told_.try_emplace(kind_of(n), Told{whole.notes.size(), n});
    Told& told = known->second;
    if (first) {
      whole.notes.push_back(fmt::format("from {:g} s: {}", from, n));
    } else if (told.text != n && ++told.others <= most_starts) {
      std::string& note = whole.notes.at(told.at);
      if (told.others > 1) note.pop_back();
      note += told.others == most_starts ? ", ...)"
              : told.others > 1          ? fmt::format(", {:g} s)", from)
                                         : fmt::format(" (with other numbers from {:g} s)", from);
    }
  }
}

void PhaseNotes::finish(RunReport& whole) {
  const auto phases = long(whole.notes.size());
  note_delivered(whole);
  if (!newton_.empty() && newton_matters(whole)) whole.notes.push_back(newton_);
  // First, as the last of a phase may tell why the run ended.
  std::rotate(whole.notes.begin(), whole.notes.begin() + phases, whole.notes.end());
  whole.delivered_note = -1;  // it is no phase
}

}  // namespace porthos::scene
