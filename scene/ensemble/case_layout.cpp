#include "scene/ensemble/case_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <limits>

#include "integrators/core/integrator.h"
#include "phs/error.h"
#include "scene/run/columns.h"

namespace porthos::scene {
namespace {

constexpr double absent = std::numeric_limits<double>::quiet_NaN();

/// Names of the state numbers, in their order.
std::vector<std::string> names_of(const phs::Description& d) {
  std::vector<std::string> names(size_t(d.nx), "");
  for (const auto& b : d.blocks)
    for (int i = 0; i < b.size; ++i) {
      const std::string one = b.size == 1 ? b.name : fmt::format("{}[{}]", b.name, i);
      names[size_t(b.at + i)] = one;
      if (b.momentum >= 0) names[size_t(b.momentum + i)] = fmt::format("p({})", one);
    }
  return names;
}

/// Whether a column is a coordinate of a joint: "arm" or "arm.attitude[2]".
bool is_of(const std::string& column, const std::string& joint) {
  return column == joint || (column.starts_with(joint) &&
                             (column[joint.size()] == '.' || column[joint.size()] == '['));
}

size_t place(const std::map<std::string, size_t>& at, const std::string& name) {
  const auto known = at.find(name);
  if (known == at.end())
    throw InvalidArgument(
        fmt::format("'{}' is of the last state of a case and of no mechanism that was foreseen: "
                    "state the order of the events by `after`",
                    name));
  return known->second;
}

std::uint64_t digest_of(std::span<const double> words) {
  std::uint64_t d = digest_of_nothing;  // a row of zeros has one too
  digest_into(d, words);
  return d;
}

}  // namespace

StateColumns::StateColumns(std::span<const std::shared_ptr<const phs::Model>> models) {
  for (const auto& model : models) {
    for (const auto& name : names_of(model->description()))
      if (number_at_.emplace(name, numbers_.size()).second) numbers_.push_back(name);
    for (const auto& name : turn_names(model->description()))
      if (angle_at_.emplace(name, angles_.size()).second) angles_.push_back(name);
  }
}

void StateColumns::put(const phs::Description& d, const phs::State& s, std::span<double> x,
                       std::span<double> lo, std::span<std::int64_t> turns) const {
  std::fill(x.begin(), x.end(), absent);
  std::fill(lo.begin(), lo.end(), absent);
  std::fill(turns.begin(), turns.end(), 0);
  const auto names = names_of(d), angles = turn_names(d);
  for (size_t i = 0; i < names.size(); ++i) {
    const size_t at = place(number_at_, names[i]);
    x[at] = s.x[i];
    lo[at] = s.lo[i];
  }
  for (size_t i = 0; i < angles.size(); ++i) turns[place(angle_at_, angles[i])] = s.turns[i];
}

void StateColumns::put_locked(const std::string& joint, const mechanics::LockedJoint& locked,
                              std::span<double> x, std::span<double> lo,
                              std::span<std::int64_t> turns) const {
  for (size_t i = 0, k = 0; i < numbers_.size() && k < locked.q.size(); ++i) {
    if (!is_of(numbers_[i], joint)) continue;
    x[i] = locked.q[k];
    lo[i] = locked.lo[k++];
  }
  for (size_t i = 0, k = 0; i < angles_.size() && k < locked.turns.size(); ++i)
    if (is_of(angles_[i], joint)) turns[i] = locked.turns[k++];
}

CaseLayout::CaseLayout(size_t columns_, const StateColumns& state, size_t events_, size_t outputs_,
                       size_t stops_)
    : columns(columns_),
      nx(state.numbers().size()),
      turns(state.angles().size()),
      events(events_),
      outputs(outputs_),
      stops(stops_) {}

void CaseLayout::seal(std::span<double> row) const {
  row[digest()] = std::bit_cast<double>(digest_of(row.first(digest())));
}
bool CaseLayout::sound(std::span<const double> row) const {
  return std::bit_cast<std::uint64_t>(row[digest()]) == digest_of(row.first(digest()));
}

const char* case_status(int status) {
  return status == case_refused         ? "refused"
         : status == case_event_refused ? "an event could not happen"
                                        : to_string(integrators::Outcome(status));
}

}  // namespace porthos::scene
