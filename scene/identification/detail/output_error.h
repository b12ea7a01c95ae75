#pragma once
#include <Eigen/Core>
#include <atomic>
#include <memory>

#include "integrators/derivatives/run_tangents.h"
#include "scene/assemble/steps.h"
#include "scene/identification/log.h"
#include "scene/sensitivity/unknowns.h"

namespace porthos::scene {

/// What a run has at the times of a log beside what the log has: r = (run - log)/σ, row by row.
class OutputError {
 public:
  /// Of central differences in z: the cube root of rounding, so that both errors are some 1e-10.
  static constexpr double apart = 6e-6;

  /// All must outlive it. The scene must have differentiable_steps().
  OutputError(const Scene& scene, const Unknowns& unknowns, const Log& log,
              const std::atomic<bool>* stop);

  /// From now on the first `rows` times of the log alone.
  void use_rows(size_t rows) { rows_ = rows; }
  size_t rows() const { return rows_; }
  /// r at z, and ∂r/∂z if `slopes` is not null: one run, with a tangent for each unknown.
  /// @return false if there is no such run: why() says the reason
  bool at(const std::vector<double>& z, Eigen::VectorXd& r, Eigen::MatrixXd* slopes);
  const std::string& why() const { return why_; }
  bool stopped() const { return stop_ && stop_->load(std::memory_order_relaxed); }

  Eigen::Index size() const;
  int runs() const { return runs_; }
  int runs_with_tangents() const { return runs_with_tangents_; }

 private:
  /// A scene put together, with its numbers that the log has.
  struct Variant {
    Variant(Scene s, const std::vector<std::string>& names)
        : scene(std::move(s)), assembly(assemble(scene)), observation(scene, assembly, names) {}
    Scene scene;
    Assembly assembly;
    Observation observation;
  };
  using VariantPtr = std::unique_ptr<Variant>;
  VariantPtr variant(const std::vector<double>& z) const;
  VariantPtr moved(std::vector<double> z, size_t k, double by) const;
  void take_row(size_t row, double theta, double t, const integrators::RunTangents& run,
                Variant& here, Eigen::VectorXd& r, Eigen::MatrixXd* slopes);
  void slope_row(size_t row, size_t k, double theta, double t, const phs::State& s,
                 const integrators::RunTangents& run, Variant& here, Eigen::MatrixXd& slopes);
  static double length_of(size_t nq, const std::vector<double>& x, const std::vector<double>& dx);

  const Scene& scene_;
  const Unknowns& unknowns_;
  const Log& log_;
  const std::atomic<bool>* stop_;
  std::vector<std::string> names_;
  std::vector<VariantPtr> up_, down_;  ///< of the run with tangents
  std::vector<double> up_values_, down_values_, tangent_;
  size_t rows_;
  std::string why_;
  int runs_ = 0, runs_with_tangents_ = 0;
};

}  // namespace porthos::scene
