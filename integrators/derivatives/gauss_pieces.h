#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "integrators/core/integrator.h"
#include "integrators/tables/collocation_table.h"

namespace porthos::integrators {

/// A step of Gauss's method from time t, of size h [s].
struct GaussPiece {
  double t, h;
  std::span<const double> Y;  ///< its stages, one after another, size s · nx
};

/// A method whose steps consist of steps of Gauss's method, with the stages of the last step: of a
/// Gauss method itself, or of a composition on the midpoint rule. It allocates nothing in a step.
class GaussPieces {
 public:
  /// The model must outlive it.
  /// @throws InvalidArgument for another method; as make_integrator()
  GaussPieces(const std::string& method, const phs::Model& model, double h);
  GaussPieces(const GaussPieces&) = delete;

  Integrator& method() { return *method_; }
  const Integrator& method() const { return *method_; }
  const CollocationTable<double>& table() const { return table_; }
  /// Pieces of a step.
  size_t count() const { return count_; }

  /// A step of the method, of another size h [s] if that is not zero. The turns of all stages are
  /// those of the state after it.
  [[nodiscard]] Outcome step(phs::State& state, double h = 0);
  /// Piece i of the last step.
  GaussPiece operator[](size_t i) const { return at(numbers_, i); }

  /// All pieces of the last step as numbers, to be kept.
  std::span<const double> numbers() const { return numbers_; }
  /// Piece i of kept numbers.
  GaussPiece at(std::span<const double> numbers, size_t i) const {
    const auto piece = numbers.subspan(i * size_, size_);
    return {piece[0], piece[1], piece.subspan(2)};
  }

 private:
  void keep(size_t i, double t, double h, const Integrator& by, const phs::State& after);
  void turn_stages(const std::vector<std::int64_t>& turns);

  std::unique_ptr<Integrator> method_;
  CollocationTable<double> table_;
  size_t n_, count_ = 1, size_ = 0;  ///< size_: numbers of a piece
  std::vector<double> numbers_;
  std::vector<size_t> angles_;  ///< their places in the state
  std::vector<std::int64_t> turns_;
};

/// The number of stages of a Gauss method. @throws InvalidArgument for another method
int gauss_stages(const std::string& method);

}  // namespace porthos::integrators
