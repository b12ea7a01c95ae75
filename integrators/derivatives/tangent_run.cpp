#include "integrators/derivatives/tangent_run.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <random>

#include "integrators/derivatives/run_tangents.h"

namespace porthos::integrators {
namespace {

/// A run with tangents along the columns of a matrix.
RunTangents run_along(const std::string& method, const phs::Model& model, const phs::State& start,
                      double h, const Eigen::MatrixXd& T) {
  std::vector<Along> directions;
  for (Eigen::Index k = 0; k < T.cols(); ++k)
    directions.push_back({.start = {T.col(k).begin(), T.col(k).end()}});
  return RunTangents(method, model, start, h, std::move(directions));
}

Eigen::MatrixXd tangents_of(const RunTangents& run) {
  Eigen::MatrixXd T(Eigen::Index(run.state().x.size()), Eigen::Index(run.size()));
  for (Eigen::Index k = 0; k < T.cols(); ++k)
    for (Eigen::Index i = 0; i < T.rows(); ++i)
      T(i, k) = run.tangent(size_t(k)).x[size_t(i)] + run.tangent(size_t(k)).lo[size_t(i)];
  return T;
}
void set_tangents(RunTangents& run, const Eigen::MatrixXd& T) {
  for (Eigen::Index k = 0; k < T.cols(); ++k)
    run.tangent(size_t(k)) = TwoWords(std::span(T.col(k).data(), size_t(T.rows())));
}

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
  RunTangents run = run_along(method, model, start, h, Eigen::MatrixXd::Identity(n, n));
  Monodromy r;
  for (std::int64_t i = 0; i < steps && r.outcome == Outcome::ok; ++i)
    r.outcome = stopped(stop) ? Outcome::failed : run.step();
  r.remark = stopped(stop) ? "the run was stopped" : run.remark();
  const Eigen::MatrixXd transposed = tangents_of(run).transpose();
  r.matrix.assign(transposed.data(), transposed.data() + transposed.size());
  r.end = run.state();
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

  RunTangents run = run_along(method, model, start, h, generic_directions(n, count));
  std::vector<double> grown(size_t(count), 0.0), first_half(grown);
  LyapunovSpectrum r;
  const std::int64_t half = steps / 2;
  for (std::int64_t i = 1 - o.settle; i <= steps; ++i) {
    r.outcome = stopped(o.stop) ? Outcome::failed : run.step();
    if (r.outcome != Outcome::ok) break;
    if (i % o.every != 0 && i != 0 && i != half && i != steps) continue;
    const Qr qr(tangents_of(run));
    set_tangents(run, orthonormal(qr, count));
    for (int k = 0; k < count && i > 0; ++k)
      grown[size_t(k)] += std::log(std::fabs(qr.matrixQR()(k, k)));
    if (i == half) first_half = grown;
  }
  r.remark = stopped(o.stop) ? "the run was stopped" : run.remark();
  r.time = double(steps) * h;
  r.end = run.state();
  for (size_t k = 0; k < grown.size(); ++k) {
    r.exponents.push_back(grown[k] / r.time);
    r.of_second_half.push_back((grown[k] - first_half[k]) / (double(steps - half) * h));
  }
  return r;
}

}  // namespace porthos::integrators
