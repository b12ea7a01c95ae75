#pragma once
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "integrators/core/integrator.h"
#include "integrators/core/stagnation.h"
#include "phs/scalars/lane.h"
#include "phs/system/description.h"

/// Parts of a step with constraints: the end of its iteration, and the rows it works with.
namespace porthos::integrators {

/// The largest moves of a sweep, relative to the sizes of their components.
struct SweepMoves {
  double all = 0;
  double positions = 0;  ///< of components that are no momenta
};

/// Sizes of a state's components within a step, the scale of moves.
template <class T>
class StateSizes {
 public:
  explicit StateSizes(const phs::Description& d)
      : size_(size_t(d.nx), 1.0), least_(size_.size(), 0.0), is_momentum_(size_.size(), 0) {
    for (const auto& b : d.blocks)
      for (size_t k = 0; k < size_t(b.size); ++k) {
        if (b.kind != phs::BlockKind::linear) least_[size_t(b.at) + k] = 1;
        if (b.momentum >= 0) is_momentum_[size_t(b.momentum) + k] = 1;
      }
  }
  /// Component k (ascending from 0) is x, and a stage is `away` from it.
  void measure(size_t k, const T& x, double away) {
    if (k == 0) largest_ = 0;
    size_[k] = std::max(double(magnitude(x)), away);
    largest_ = std::max(largest_, size_[k]);
  }
  /// After the last component.
  void settle() {
    for (size_t k = 0; k < size_.size(); ++k)
      size_[k] = std::max({size_[k], least_[k], 1e-4 * largest_, 1e-300});
  }
  void count(size_t k, double move, SweepMoves& moves) const {
    const double relative = move / size_[k];
    moves.all = std::max(moves.all, relative);
    if (!is_momentum_[k]) moves.positions = std::max(moves.positions, relative);
  }

 private:
  std::vector<double> size_;
  std::vector<double> least_;  ///< 1 of angles and quaternions: rows see them through sines
  std::vector<char> is_momentum_;
  double largest_ = 0;
};

/// When the iteration of a step with constraints ends: its moves have not halved for some sweeps,
/// and those of positions are near rounding. Momenta need not be: of a mechanism at rest they are
/// noise, which never gets small against itself. The impulses are no part of the rule: they settle
/// only to u κ/h.
class SweepEnd {
 public:
  enum class Verdict { go_on, ended, diverges };

  SweepEnd(double rounding, double tolerance) : rounding_(rounding), tolerance_(tolerance) {}
  void restart() {
    best_ = best_position_ = HUGE_VAL;
    idle_ = 0;
  }
  Verdict after(const SweepMoves& moves) {
    best_position_ = std::min(best_position_, moves.positions);
    if (moves.all < 0.5 * best_) {
      best_ = moves.all;
      idle_ = 0;
    } else {
      ++idle_;
    }
    if (moves.all == 0 || moves.all <= tolerance_) return Verdict::ended;
    // Small components of a large state may never get near rounding by their own size.
    if (idle_ >= (best_ < 360 * rounding_ ? 2 : 6) && near_rounding()) return Verdict::ended;
    return idle_ > 12 || moves.all > 1e6 * best_ ? Verdict::diverges : Verdict::go_on;
  }
  bool near_rounding() const { return best_position_ < 1e5 * rounding_; }

 private:
  double rounding_, tolerance_, best_ = HUGE_VAL, best_position_ = HUGE_VAL;
  int idle_ = 0;
};

/// Sweeps until `end` says so, at most `most`. once(moves): a sweep. @return whether it is finite
template <class Once>
Outcome sweep_to_end(SweepEnd& end, int most, const Once& once) {
  end.restart();
  for (int sweep = 0; sweep < most; ++sweep) {
    SweepMoves moves;
    if (!once(moves)) return Outcome::not_finite;
    switch (end.after(moves)) {
      case SweepEnd::Verdict::ended:
        return Outcome::ok;
      case SweepEnd::Verdict::diverges:
        return Outcome::not_converged;
      case SweepEnd::Verdict::go_on:
        break;
    }
  }
  return end.near_rounding() ? Outcome::ok : Outcome::not_converged;
}

/// The constraints at the ends of a step: which rows are independent, and whether they still are.
template <class T>
class StepRows {
 public:
  StepRows(phs::System<T>& system, size_t m) : rows_(system.constraints()), g_(m), used_(m, true) {
    active_.reserve(m);
  }

  /// The evaluator, placed and factored where it was placed last.
  phs::Constraints<T>& operator*() const { return *rows_; }
  phs::Constraints<T>* operator->() const { return rows_.get(); }

  /// Places and factors the rows at x.
  void move_to(const std::vector<T>& x) {
    x_ = x;
    rows_->place(x_, g_);
    rows_->factor(x_);
    placed_ = true;
  }
  /// Tells that x differs in momenta only from where the rows are: they stay as they are.
  void keep_at(const std::vector<T>& x) { x_ = x; }
  /// The rows of a step that starts at x. It works only with these, even if others look independent
  /// off the manifold. @return whether they are those of the last step
  bool choose(const std::vector<T>& x) {
    bool same = placed_;
    for (size_t k = 0; same && k < x.size(); ++k) same = phs::identical(x_[k], x[k]);
    if (!same) move_to(x);
    trouble_ = rows_->rank() < rank_ ? text() : "";
    rank_ = std::max(rank_, rows_->rank());
    best_pivot_ = std::max(best_pivot_, rows_->smallest_pivot());
    same = true;
    active_.clear();
    for (size_t r = 0; r < used_.size(); ++r) {
      const bool used = rows_->uses(int(r));
      same = same && used_[r] == used;
      used_[r] = used;
      if (used) active_.push_back(r);
    }
    return same;
  }
  /// The rows in use since then.
  const std::vector<size_t>& active() const { return active_; }
  /// A step ended with o, not ok: the next choose() places the rows anew. @return o, or singular
  /// for one that did not converge near a singular position, which trouble() then tells
  Outcome give_up(Outcome o) {
    placed_ = false;
    if (o != Outcome::not_converged || !near_singular()) return o;
    trouble_ = text();
    return Outcome::singular;
  }
  /// The loss of rank at the last choice, as text; empty: none.
  const std::string& trouble() const { return trouble_; }
  void set_turn_angles(std::span<const T> angles) {
    rows_->set_turn_angles(angles);
    placed_ = false;
  }
  void carry(Archive& a) {
    a(rank_);
    a(best_pivot_);
    for (size_t r = 0; r < used_.size(); ++r) {
      bool used = used_[r];
      a(used);
      used_[r] = used;
    }
    if (a.loads()) placed_ = false;
  }

 private:
  bool near_singular() const { return rows_->smallest_pivot() < 0.01 * best_pivot_; }
  std::string text() const {
    return "rank " + std::to_string(rows_->rank()) + " of " + std::to_string(rank_) +
           ", smallest pivot " + number(rows_->smallest_pivot(), 3);
  }

  std::unique_ptr<phs::Constraints<T>> rows_;
  std::vector<T> x_, g_;
  std::vector<bool> used_;
  std::vector<size_t> active_;
  std::string trouble_;
  int rank_ = 0;           ///< the largest so far
  double best_pivot_ = 0;  ///< the largest smallest_pivot() so far
  bool placed_ = false;
};

}  // namespace porthos::integrators
