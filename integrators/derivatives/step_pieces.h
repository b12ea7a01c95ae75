#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "integrators/methods/semi_implicit_euler.h"
#include "integrators/methods/staged_steps.h"

namespace porthos::integrators {

/// A step that its stages describe (StagedSteps), from time t, of size h [s].
struct StepPiece {
  double t, h;
  std::span<const double> Y;                 ///< its stages, one after another, size s · nx
  std::span<const double> multipliers = {};  ///< StagedSteps::multipliers()
};

/// A method whose steps consist of pieces, with the stages of the last step: of a Runge-Kutta
/// method or Störmer-Verlet itself, of a composition, or of the steps of its own that a method
/// takes inside a step. It allocates nothing in a step, unless it has more pieces than any before.
class StepPieces {
 public:
  /// The model must outlive it.
  /// @throws InvalidArgument for another method; as make_integrator()
  StepPieces(const std::string& method, const phs::Model& model, double h);
  StepPieces(const StepPieces&) = delete;

  Integrator& method() { return *method_; }
  const Integrator& method() const { return *method_; }
  /// What describes a piece.
  const StagedSteps<double>& staged() const { return *staged_; }
  /// That of a piece.
  const CollocationTable<double>& table() const { return table_; }
  /// Whether the derivative of a piece is that of the table alone.
  bool by_table() const {
    return multipliers() == 0 && !dynamic_cast<const StepsByDuals<double>*>(staged_) &&
           !dynamic_cast<const SemiImplicitEulerSteps*>(staged_);
  }
  /// Multipliers of a piece.
  size_t multipliers() const { return staged_->multipliers(); }
  /// Pieces of the last step; before it of any, or 0 if that is not known.
  size_t count() const { return count_; }
  /// Numbers of a piece.
  size_t size() const { return size_; }

  /// A step of the method, of another size h [s] if that is not zero. The turns of all stages are
  /// those of the state after it.
  [[nodiscard]] Outcome step(phs::State& state, double h = 0);
  /// Piece i of the last step.
  StepPiece operator[](size_t i) const { return at(numbers_, i); }

  /// All pieces of the last step as numbers, to be kept.
  std::span<const double> numbers() const { return std::span(numbers_).first(count_ * size_); }
  /// Piece i of kept numbers.
  StepPiece at(std::span<const double> numbers, size_t i) const {
    const auto piece = numbers.subspan(i * size_, size_);
    return {piece[0], piece[1], piece.subspan(2, stages_), piece.subspan(2 + stages_)};
  }

 private:
  void keep(size_t i, double t, double h, const phs::State& after);
  void turn_stages(const std::vector<std::int64_t>& turns);

  std::unique_ptr<Integrator> method_;
  const StagedSteps<double>* staged_ = nullptr;  ///< the method, or the base of a composition
  CollocationTable<double> table_;
  bool watched_ = false;  ///< tells its pieces
  size_t n_, count_ = 1, stages_ = 0, size_ = 0;
  std::vector<double> numbers_;
  std::vector<size_t> angles_;  ///< their places in the state
  std::vector<std::int64_t> turns_;
};

/// The number of stages of a Gauss method. @throws InvalidArgument for another method
int gauss_stages(const std::string& method);

}  // namespace porthos::integrators
