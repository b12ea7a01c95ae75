#include "integrators/derivatives/tangent_run.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <random>

#include "integrators/tables/collocation_table.h"

namespace porthos::integrators {
namespace {

/// A run and tangents along it. Each has a variation of its own, which starts its iteration from
/// the step before.
class TangentRun {
 public:
  TangentRun(const std::string& method, const phs::Model& model, const phs::State& start, double h,
             const Eigen::MatrixXd& tangents)
      : state(start),
        table_(gauss_table<double>(gauss_stages(method))),
        method_(make_integrator(method, model, h, {.port_work = false})),
        n_(size_t(model.description().nx)),
        stages_(size_t(table_.s) * n_) {
    require_size("x", start.x.size(), n_);
    for (Eigen::Index k = 0; k < tangents.cols(); ++k) {
      variations_.push_back(make_step_variation(model, table_.s, h, StepVariation::Side::tangent));
      tangents_.emplace_back(n_);
    }
    set(tangents);
  }

  Outcome step() {
    const double t = method_->time(state);
    const Outcome o = method_->step(state);
    if (o != Outcome::ok) return fail(o, "the step", t);
    for (size_t i = 0; i < size_t(table_.s); ++i)
      (void)method_->interpolate(state, table_.c[i], std::span(stages_).subspan(i * n_, n_));
    for (size_t k = 0; k < tangents_.size(); ++k) {
      variations_[k]->at(t, stages_, state.turns);
      const Outcome of_tangent = variations_[k]->advance(tangents_[k]);
      if (of_tangent != Outcome::ok) return fail(of_tangent, "a tangent of the step", t);
    }
    return Outcome::ok;
  }

  Eigen::MatrixXd tangents() const {
    Eigen::MatrixXd T(Eigen::Index(n_), Eigen::Index(tangents_.size()));
    for (size_t k = 0; k < tangents_.size(); ++k)
      for (size_t i = 0; i < n_; ++i)
        T(Eigen::Index(i), Eigen::Index(k)) = tangents_[k].x[i] + tangents_[k].lo[i];
    return T;
  }
  void set(const Eigen::MatrixXd& T) {
    for (size_t k = 0; k < tangents_.size(); ++k)
      for (size_t i = 0; i < n_; ++i) {
        tangents_[k].x[i] = T(Eigen::Index(i), Eigen::Index(k));
        tangents_[k].lo[i] = 0;
      }
  }

  phs::State state;
  std::string remark;

 private:
  Outcome fail(Outcome o, const char* what, double t) {
    remark = std::string(what) + " at t = " + number(t) + " s: " + to_string(o);
    return o;
  }

  CollocationTable<double> table_;
  std::unique_ptr<Integrator> method_;
  size_t n_;
  std::vector<double> stages_;
  std::vector<std::unique_ptr<StepVariation>> variations_;
  std::vector<TwoWords> tangents_;
};

void require_steps(std::int64_t steps, std::int64_t least) {
  if (steps < least)
    throw InvalidArgument("steps is " + std::to_string(steps) +
                          ", expected steps >= " + std::to_string(least));
}

using Qr = Eigen::HouseholderQR<Eigen::MatrixXd>;

Eigen::MatrixXd orthonormal(const Qr& qr, int count) {
  return qr.householderQ() * Eigen::MatrixXd::Identity(qr.rows(), count);
}

/// Orthonormal ones, the same in every run. The axes themselves may lie in a subspace that the
/// motion keeps.
Eigen::MatrixXd generic_directions(int n, int count) {
  std::mt19937_64 rng(1);
  Eigen::MatrixXd T(n, count);
  for (int k = 0; k < count; ++k)
    for (int i = 0; i < n; ++i) T(i, k) = double(rng() >> 11) * 0x1p-52 - 1;
  return orthonormal(Qr(T), count);
}

bool stopped(const std::atomic<bool>* stop) {
  return stop && stop->load(std::memory_order_relaxed);
}

}  // namespace

Monodromy monodromy(const std::string& method, const phs::Model& model, const phs::State& start,
                    double h, std::int64_t steps, const std::atomic<bool>* stop) {
  require_steps(steps, 0);
  const auto n = Eigen::Index(model.description().nx);
  TangentRun run(method, model, start, h, Eigen::MatrixXd::Identity(n, n));
  Monodromy r;
  for (std::int64_t i = 0; i < steps && r.outcome == Outcome::ok; ++i)
    r.outcome = stopped(stop) ? Outcome::failed : run.step();
  r.remark = stopped(stop) ? "the run was stopped" : run.remark;
  const Eigen::MatrixXd transposed = run.tangents().transpose();
  r.matrix.assign(transposed.data(), transposed.data() + transposed.size());
  r.end = run.state;
  return r;
}

LyapunovSpectrum lyapunov_spectrum(const std::string& method, const phs::Model& model,
                                   const phs::State& start, double h, std::int64_t steps,
                                   const LyapunovOptions& o) {
  require_steps(steps, 2);
  const int n = model.description().nx, count = o.count == 0 ? n : o.count;
  if (count < 0 || count > n)
    throw InvalidArgument("count is " + std::to_string(count) + ", expected 1 to " +
                          std::to_string(n) + ", the numbers of the state, or 0 for all");
  if (o.every < 1)
    throw InvalidArgument("every is " + std::to_string(o.every) + ", expected every >= 1");
  if (o.settle < 0)
    throw InvalidArgument("settle is " + std::to_string(o.settle) + ", expected settle >= 0");

  TangentRun run(method, model, start, h, generic_directions(n, count));
  std::vector<double> grown(size_t(count), 0.0), first_half(grown);
  LyapunovSpectrum r;
  const std::int64_t half = steps / 2;
  for (std::int64_t i = 1 - o.settle; i <= steps; ++i) {
    r.outcome = stopped(o.stop) ? Outcome::failed : run.step();
    if (r.outcome != Outcome::ok) break;
    if (i % o.every != 0 && i != 0 && i != half && i != steps) continue;
    const Qr qr(run.tangents());
    run.set(orthonormal(qr, count));
    for (int k = 0; k < count && i > 0; ++k)
      grown[size_t(k)] += std::log(std::fabs(qr.matrixQR()(k, k)));
    if (i == half) first_half = grown;
  }
  r.remark = stopped(o.stop) ? "the run was stopped" : run.remark;
  r.time = double(steps) * h;
  r.end = run.state;
  for (size_t k = 0; k < grown.size(); ++k) {
    r.exponents.push_back(grown[k] / r.time);
    r.of_second_half.push_back((grown[k] - first_half[k]) / (double(steps - half) * h));
  }
  return r;
}

}  // namespace porthos::integrators
