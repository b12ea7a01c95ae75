#include "integrators/derivatives/replay.h"

#include <algorithm>
#include <cmath>

namespace porthos::integrators {

Replay::Replay(const std::string& method, const phs::Model& model, double h,
               const GradientOptions& options)
    : options_(options),
      pieces_(method, model, h),
      method_(pieces_.method()),
      instants_(model),
      tangent_(std::span<const double>(options.direction)),
      n_(size_t(model.description().nx)),
      instant_(instants_.size()) {
  if (!options.taken.empty()) method_.sampler().go_by_the_clock();
  if (!options.has_direction()) return;
  if (instants_.any())
    throw InvalidArgument("a direction takes no sampled controllers, and '" +
                          model.description().name + "' has '" + model.holds().front()->name +
                          "', expected a gradient without one");
  if (options.direction.empty()) tangent_ = TwoWords(n_);
  require_size("direction", tangent_.x.size(), n_);
  if (!options.parameter_direction.empty())
    of_field_ = std::make_unique<FieldChange>(model, pieces_, options.parameter_direction);
  along_ = make_step_variation(model, pieces_, StepVariation::Side::tangent);
  of_piece_ = size_t(pieces_.table().s) * n_;
}

bool Replay::take(const phs::State& start, std::int64_t steps, size_t returns) {
  const Checkpoint here{start, method_.memory(), method_.sampler().memory(), tangent_};
  first_ = start.step;
  whole_until_ = start.step + steps;
  length_ = options_.taken.empty() ? double(steps) * method_.step_size() + options_.last
                                   : start.until(options_.taken.back().origin, method_.step_size());
  if (options_.last != 0) ++steps;
  plan(steps, here);
  work_ = double(forward_steps(steps, levels_) + steps * std::int64_t(returns));
  if (steps > 0) return reverse(here, steps, levels_);
  begin_once(start);
  return true;
}

/// Half of the memory holds the steps of a segment, half checkpoints. More levels where a run has
/// more segments than checkpoints.
void Replay::plan(std::int64_t steps, const Checkpoint& c) {
  const size_t row = row_size(pieces_of_a_step(c)), half = options_.memory / 2 / sizeof(double),
               words = 2 * n_ + c.state.turns.size() + c.memory.size() + c.held.size() +
                       2 * c.tangent.x.size();
  segment_ = std::max<std::int64_t>(1, std::int64_t(half / row));
  const double checkpoints = double(half) / double(words + 16);
  for (levels_ = 0;; ++levels_) {
    fan_ = std::max<std::int64_t>(2, std::int64_t(checkpoints / std::max(1, levels_)));
    if (double(segment_) * std::pow(double(fan_), levels_) >= double(steps)) break;
  }
  if (levels_ == 0) segment_ = steps;
  kept_.reserve(size_t(segment_) * row);
}
/// Numbers kept of a step: its pieces and its end, and the tangent there.
size_t Replay::row_size(size_t pieces) const {
  return pieces * (pieces_.size() + of_piece_) + n_ + tangent_.x.size() + instant_.size();
}
/// Of a method that chooses its own steps inside a step: those of the first.
size_t Replay::pieces_of_a_step(const Checkpoint& first) {
  if (pieces_.count() == 0 && whole_until_ > first_) {
    restore(first);
    (void)step_forwards();
    restore(first);
  }
  return std::max<size_t>(1, pieces_.count());
}

/// Steps between two checkpoints of a level.
std::int64_t Replay::part_of(int level) const {
  std::int64_t part = segment_;
  for (int i = 1; i < level; ++i) part *= fan_;
  return part;
}
/// Steps that reverse() takes forwards.
std::int64_t Replay::forward_steps(std::int64_t steps, int level) const {
  if (steps <= segment_) return steps;
  const std::int64_t part = part_of(level), parts = (steps - 1) / part;
  return parts * (part + forward_steps(part, level - 1)) +
         forward_steps(steps - parts * part, level - 1);
}
/// Takes `steps` steps from a checkpoint and hands them back.
bool Replay::reverse(const Checkpoint& from, std::int64_t steps, int level) {
  if (steps <= segment_) return forwards(from, steps, true) && hand_back();
  const std::int64_t part = part_of(level);
  std::vector<Checkpoint> checkpoints{from};
  restore(from);
  for (std::int64_t done = part; done < steps; done += part) {
    if (!steps_forwards(part, false)) return false;
    checkpoints.push_back({state_, method_.memory(), method_.sampler().memory(), tangent_});
  }
  std::int64_t left = steps - part * std::int64_t(checkpoints.size() - 1);
  for (; !checkpoints.empty(); left = part) {
    if (!reverse(checkpoints.back(), left, level - 1)) return false;
    checkpoints.pop_back();
  }
  return true;
}

bool Replay::forwards(const Checkpoint& from, std::int64_t steps, bool keep) {
  restore(from);
  kept_.clear();
  rows_.clear();
  turns_.clear();
  return steps_forwards(steps, keep);
}
void Replay::restore(const Checkpoint& from) {
  method_.restore(from.memory);
  method_.sampler().restore(from.held);
  state_ = from.state;
  tangent_ = from.tangent;
  if (along_) along_->forget();
}
bool Replay::steps_forwards(std::int64_t steps, bool keep) {
  for (std::int64_t i = 0; i < steps; ++i) {
    if (!went_on()) return false;
    const double t = method_.time(state_);
    const Outcome o = step_forwards();
    if (o != Outcome::ok) return give_up(o, "the step at t = " + number(t) + " s: " + to_string(o));
    if (along_ && !tangent_forwards()) return false;
    if (keep) keep_step();
  }
  return true;
}
Outcome Replay::step_forwards() {
  if (instants_.any()) before_ = state_;
  if (options_.taken.empty())
    return pieces_.step(state_, state_.step == whole_until_ ? options_.last : 0);
  const TakenStep& taken = options_.taken[size_t(state_.step - first_)];
  const Outcome o = pieces_.step(state_, taken.size);
  if (o != Outcome::ok) return o;
  state_.origin = taken.origin;
  state_.origin_lo = taken.origin_lo;
  return o;
}
bool Replay::tangent_forwards() {
  tangent_stages_.resize(pieces_.count() * of_piece_);
  for (size_t i = 0; i < pieces_.count(); ++i) {
    const StepPiece piece = pieces_[i];
    along_->at(piece, state_.turns);
    const auto changes = of_field_ ? of_field_->at(piece, state_.turns) : std::span<const double>();
    if (const Outcome o = along_->advance(tangent_, changes); o != Outcome::ok)
      return give_up(o,
                     "the tangent of the step at t = " + number(piece.t) + " s: " + to_string(o));
    along_->stages(std::span(tangent_stages_).subspan(i * of_piece_, of_piece_));
  }
  return true;
}
void Replay::keep_step() {
  if (turns_.empty() || turns_.back().turns != state_.turns)
    turns_.push_back({rows_.size(), state_.turns});
  rows_.push_back(kept_.size());
  const auto keep = [&](std::span<const double> numbers) {
    kept_.insert(kept_.end(), numbers.begin(), numbers.end());
  };
  if (instants_.any()) instants_.keep(method_, before_, state_.turns, instant_);
  keep(pieces_.numbers());
  keep(state_.x);
  keep(tangent_stages_);
  keep(tangent_.x);
  keep(instant_);
}

bool Replay::hand_back() {
  begin_once(state_);
  for (size_t i = rows_.size(), to = kept_.size(); i-- > 0; to = rows_[i]) {
    while (turns_.back().from > i) turns_.pop_back();
    const auto step = std::span<const double>(kept_).subspan(rows_[i], to - rows_[i]);
    const size_t pieces = (step.size() - row_size(0)) / (row_size(1) - row_size(0)),
                 of_pieces = pieces * pieces_.size();
    const auto instant = step.last(instant_.size());
    const auto tangents = step.first(step.size() - instant_.size()).subspan(of_pieces + n_);
    if (!back({step.first(of_pieces), step.subspan(of_pieces, n_),
               tangents.first(pieces * of_piece_), tangents.subspan(pieces * of_piece_),
               turns_.back().turns, instant}))
      return false;
  }
  return true;
}
void Replay::begin_once(const phs::State& end) {
  if (!begun_) begin(end, tangent_.x);
  begun_ = true;
}

bool Replay::went_on() {
  if (options_.stop && options_.stop->load(std::memory_order_relaxed))
    return give_up(Outcome::failed, "the run was stopped");
  if (++done_ % 64 == 0 && options_.progress)
    options_.progress(std::min(1.0, double(done_) / work_));
  return true;
}
bool Replay::give_up(Outcome o, const std::string& why) {
  outcome_ = o;
  remark_ = why;
  return false;
}

}  // namespace porthos::integrators
