#include "scene/identification/identification.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "scene/assemble/model_notes.h"
#include "scene/identification/detail/least_squares.h"
#include "scene/identification/detail/log_units.h"
#include "scene/identification/detail/momentum_regression.h"
#include "scene/identification/detail/output_error.h"
#include "scene/judge/trajectory_table.h"
#include "scene/sensitivity/differentiable.h"

namespace porthos::scene {
namespace {

constexpr const char* without_slopes = "; fit porthos.Scene(change=...) with scipy's least_squares";

using Eigen::Index, Eigen::MatrixXd;

/// ∂(values)/∂z by central differences: their z are of order one.
MatrixXd value_slopes(const Unknowns& unknowns, const std::vector<double>& z) {
  constexpr double d = OutputError::apart;
  const auto n = Index(z.size());
  MatrixXd P(n, n);
  for (size_t k = 0; k < z.size(); ++k) {
    auto at = z;
    at[k] = z[k] + d;
    const auto up = unknowns.values(at);
    at[k] = z[k] - d;
    const auto down = unknowns.values(at);
    for (size_t i = 0; i < z.size(); ++i) P(Index(i), Index(k)) = (up[i] - down[i]) / (2 * d);
  }
  return P;
}

void add_uncertainty(Identification& r, const Fit& fit, const Unknowns& unknowns) {
  constexpr double hardly = 1e-3;  // part of a parameter in a combination
  const auto n = Index(unknowns.size());
  const MatrixXd P = value_slopes(unknowns, fit.z);
  MatrixXd covariance = MatrixXd::Zero(n, n);
  Eigen::VectorXd lost = Eigen::VectorXd::Zero(n);
  for (Index i = 0; i < n; ++i) {
    const Eigen::VectorXd moves = P * fit.directions.col(i);
    const double deviation = fit.deviation(i);
    Combination c{deviation, fit.tells(i), {}};
    double largest = 0;
    for (Index k = 0; k < n; ++k) {
      c.moves.push_back(moves[k] / unknowns.list()[size_t(k)].scale);
      if (std::fabs(c.moves.back()) > std::fabs(largest)) largest = c.moves.back();
    }
    for (double& m : c.moves) m /= largest;
    r.combinations.push_back(std::move(c));
    if (std::isfinite(deviation))
      covariance += deviation * deviation * moves * moves.transpose();
    else
      lost += moves.cwiseAbs();
  }
  r.covariance.assign(covariance.data(), covariance.data() + covariance.size());
  for (Index k = 0; k < n; ++k) {
    const double scale = unknowns.list()[size_t(k)].scale;
    r.found[size_t(k)].deviation = lost[k] > hardly * scale ? NAN : std::sqrt(covariance(k, k));
  }
}

void add_agreement(Identification& r, const Eigen::VectorXd& before, const Eigen::VectorXd& after,
                   const Log& log) {
  const size_t columns = log.columns.size(), rows = log.times.size();
  r.before.assign(columns, {});
  r.after.assign(columns, {});
  for (size_t i = 0; i < columns; ++i) {
    const LogColumn& c = log.columns[i];
    Agreement a{c.of, c.sigma, 0, 0};
    for (size_t row = 0; row < rows; ++row) {
      const auto at = Index(row * columns + i);
      r.before[i].push_back(before[at]);
      r.after[i].push_back(after[at]);
      a.before += before[at] * before[at];
      a.after += after[at] * after[at];
    }
    const double sigma = c.sigma > 0 ? c.sigma : 1;
    a.before = sigma * std::sqrt(a.before / double(rows));
    a.after = sigma * std::sqrt(a.after / double(rows));
    r.columns.push_back(a);
  }
}

/// The covariance takes noise to be independent from row to row. Noise of a correlation ρ moves
/// values of slow columns by √((1 + ρ)/(1 - ρ)) times as much.
void note_correlated_noise(Identification& r, const Log& log) {
  const double rows = double(log.times.size());
  for (size_t i = 0; i < log.columns.size(); ++i) {
    const auto [least, most] = std::ranges::minmax(log.columns[i].values);
    const double sigma = log.columns[i].sigma, left = r.columns[i].after;
    if (left < 0.1 * sigma || left < 1e-6 * (most - least)) continue;  // no noise at all
    double both = 0, squares = 0;
    for (size_t k = 0; k < r.after[i].size(); ++k) {
      squares += r.after[i][k] * r.after[i][k];
      if (k > 0) both += r.after[i][k - 1] * r.after[i][k];
    }
    const double correlation = both / squares;
    if (!(correlation > std::max(0.2, 5 / std::sqrt(rows)))) continue;
    r.notes.push_back(fmt::format(
        "what is left of '{}' goes on from row to row, with a correlation of {:.2f}: by such noise "
        "the sigmas found may be up to {:.1f} times too small, expected rows further apart",
        r.columns[i].of.name, correlation, std::sqrt((1 + correlation) / (1 - correlation))));
  }
}

void add_notes(Identification& r, const Scene& scene, const Log& log, const std::string& edge) {
  constexpr size_t most = 6;
  const double first = log.times.front(), length = log.times.back() - first;
  if (first > 10 * length / double(log.times.size()))
    r.notes.push_back(fmt::format(
        "the log begins at {:g} s, the scene at 0: where they begin together, take {:g} s from the "
        "log's times; where it was cut from a longer one, ask for its start too, as "
        "\"joint_1.position\"",
        first, first));
  if (!log.unused.empty()) {
    std::vector<std::string> some(
        log.unused.begin(), log.unused.begin() + std::ptrdiff_t(std::min(most, log.unused.size())));
    r.notes.push_back(fmt::format(
        "columns of the log that are not used: {}{}", listed(some, [](const auto& n) { return n; }),
        log.unused.size() > most ? fmt::format(" and {} more", log.unused.size() - most) : ""));
  }
  if (!edge.empty())
    r.notes.push_back("the fit ended at the edge of what can be: the next step was refused, " +
                      edge);
  else if (!r.converged)
    r.notes.push_back(fmt::format(
        "the fit stopped after {} iterations before it converged: its numbers are not the best",
        r.iterations));
  if (r.noise_known() && r.surprise() > 3)
    r.notes.push_back(
        "the run disagrees with the log by more than sigma says: the model lacks something, or "
        "sigma is too small");
  else
    note_correlated_noise(r, log);
  if (r.step_error > 0.5)
    r.notes.push_back(fmt::format(
        "half the step moves the values found by {:.1f} of their sigma, expected a shorter one by "
        "--step",
        r.step_error));
  if (!scene.files.empty() || !scene.robots.empty() || scene.start_from)
    r.notes.push_back("found.toml names files relative to the folder of the scene: copy it there");
}

/// Why the values are not found though the iteration came to its end: the run is no nearer to the
/// log than before, or angles are in degrees. Empty: they are found.
std::string why_not_found(const Identification& r, const Log& log, const Eigen::VectorXd& before,
                          const Eigen::VectorXd& after) {
  constexpr double digits = 1e-6, lost = 0.5;  // lost: an angle that the run does not follow [rad]
  const double from = before.squaredNorm(), to = after.squaredNorm();
  double angle = 0;
  for (size_t i = 0; i < log.columns.size(); ++i)
    if (log.columns[i].of.wraps && r.columns[i].after > lost)
      for (const double q : log.columns[i].values) angle = std::max(angle, std::fabs(q));
  const std::string question = ask_about_degrees(angle);
  const bool disagrees = r.noise_known() && r.surprise() > 3;
  const bool no_nearer = to > (1 + digits) * from || (disagrees && to > (1 - digits) * from);
  if (!no_nearer) return question.empty() ? "" : "the log is not told by the run: " + question;
  return fmt::format(
      "nothing is found: rms of (run - log)/sigma {:.4g} before, {:.4g} after: {}",
      std::sqrt(from / double(before.size())), std::sqrt(to / double(after.size())),
      question.empty() ? "expected start values nearer to the log, or other parameters" : question);
}

/// Identification::step_error, from a run with half the step.
double step_error(Scene scene, const Unknowns& unknowns, const Log& log, const Fit& fit,
                  const std::atomic<bool>* stop) {
  scene.step /= 2;
  OutputError half(scene, unknowns, log, stop);
  Eigen::VectorXd r;
  if (!half.at(fit.z, r, nullptr)) return NAN;
  double most = 0;
  for (Index i = 0; i < fit.singular.size(); ++i)
    if (fit.tells(i)) most = std::max(most, std::fabs(fit.shift(r - fit.r, i)));
  return most;
}

/// Refuses a scene whose run has no tangents, before anything else.
Assembly assemble_with_tangents(Scene scene) {
  (void)integrators::gauss_stages(scene.method);
  if (scene.step_control != integrators::StepControl::fixed)
    throw InvalidArgument(
        fmt::format("{}a fit takes steps of one size, and the scene has step_control = \"{}\"",
                    in_file(scene.path), integrators::to_string(scene.step_control)));
  Assembly a = assemble(scene);
  scene.duration = scene.step;  // that of the log is a whole number of them
  (void)differentiable_steps(scene, a, "");
  return a;
}

/// The log is fitted from its beginning, over lengths that double: far from the values found, the
/// end of a long run is in another turn of the motion than the log, and least squares would stop at
/// the nearest one.
/// @param near  the start is near the values found: the whole log at once
Fit fit_by_lengths(OutputError& error, std::vector<double> start, bool near, const Log& log,
                   const IdentificationRequest& request) {
  constexpr double loosely = 0.1;
  const size_t rows = log.times.size();
  size_t length = near ? rows : std::min(rows, 1 + 4 * start.size() / log.columns.size());
  Fit all;
  all.z = std::move(start);
  for (bool last = false; !last; length = std::min(rows, 2 * length)) {
    last = length == rows;
    error.use_rows(length);
    Fit fit = least_squares(
        [&](const auto& z, auto& r, auto* slopes) { return error.at(z, r, slopes); }, all.z,
        {.noise_known = log.columns.front().sigma > 0,
         .share = last ? 0 : loosely,
         .most = request.iterations - all.iterations,
         .go_on = [&](const Fit& f) {
           if (request.tell)
             request.tell({all.iterations + f.iterations, error.runs(), log.times[length - 1],
                           f.r.squaredNorm() / double(error.size())});
           return !error.stopped();
         }});
    fit.iterations += all.iterations;
    fit.refused += all.refused;
    if (fit.iterates.empty() || error.stopped()) return fit;
    fit.iterates.insert(fit.iterates.begin(), all.iterates.begin(), all.iterates.end());
    all = std::move(fit);
  }
  return all;
}

/// Where the fit begins, and whether that is near to where it ends: the bodies by their momenta,
/// where their run is nearer to the log than that of the scene; else starts as the first rows of
/// the log tell them if that run is nearer.
std::pair<std::vector<double>, bool> start_of_fit(Identification& r, const Scene& scene,
                                                  const Assembly& assembly,
                                                  const Unknowns& unknowns, const Log& log,
                                                  OutputError& error,
                                                  const Eigen::VectorXd& before) {
  constexpr double near = 1e-2;  // of the squared distance
  const auto z = bodies_by_momenta(scene, assembly, unknowns, log);
  Eigen::VectorXd after;
  r.by_momenta =
      !z.empty() && error.at(z, after, nullptr) && !(after.squaredNorm() >= before.squaredNorm());
  if (!r.by_momenta) {
    const auto as_logged = with_start_of(log, unknowns);
    const bool nearer = as_logged != unknowns.start() && error.at(as_logged, after, nullptr) &&
                        !(before.squaredNorm() <= after.squaredNorm());
    return {nearer ? as_logged : unknowns.start(), false};
  }
  return {z, after.squaredNorm() < near * before.squaredNorm()};
}

Identification identify(Scene scene, const Assembly& assembly, const Log& log,
                        const IdentificationRequest& request) {
  require_units(log, scene);
  scene.duration = scene.step * std::max(1.0, std::ceil(log.times.back() / scene.step - 1e-9));
  const Unknowns unknowns(scene, assembly, request.parameters);
  const size_t numbers = log.times.size() * log.columns.size();
  if (numbers <= unknowns.size())
    throw InvalidArgument(fmt::format("{}: it has {} numbers for {} parameters, expected more",
                                      log.path, numbers, unknowns.size()));
  OutputError error(scene, unknowns, log, request.stop);
  Identification r;
  r.title = scene.title;
  r.log = log.path;
  r.method = scene.method;
  r.step = scene.step;
  r.times = log.times;
  Eigen::VectorXd before;
  if (!error.at(unknowns.start(), before, nullptr)) before.setConstant(error.size(), NAN);
  r.notes = questions_before(log, before, unknowns);
  for (const auto& note : r.notes)
    if (request.say) request.say("note: " + note);
  const auto [start, near] = start_of_fit(r, scene, assembly, unknowns, log, error, before);
  const Fit fit = fit_by_lengths(error, start, near, log, request);
  r.iterations = fit.iterations;
  r.runs = error.runs();
  r.runs_with_tangents = error.runs_with_tangents();
  r.refused = fit.refused;
  r.converged = fit.converged;
  if (fit.iterates.empty() || error.stopped()) {
    r.failure = error.stopped() ? "the command was stopped" : error.why();
    return r;
  }
  const auto values = unknowns.values(fit.z);
  for (size_t i = 0; i < values.size(); ++i) r.found.push_back({unknowns.list()[i], values[i], 0});
  for (const auto& z : fit.iterates) r.iterates.push_back(unknowns.values(z));
  r.chi_square = fit.r.squaredNorm();
  r.noise = fit.noise;
  r.freedoms = numbers - unknowns.size();
  r.step_error = step_error(scene, unknowns, log, fit, request.stop);
  add_uncertainty(r, fit, unknowns);
  add_agreement(r, before, fit.r, log);
  add_notes(r, scene, log, fit.at_edge ? error.why() : "");
  if (const auto why = why_not_found(r, log, before, fit.r); !why.empty()) {
    r.notes.insert(r.notes.begin(), why);
    r.converged = false;
  }
  r.scene = unknowns.text(fit.z);
  return r;
}

}  // namespace

double Identification::surprise() const {
  const double n = double(freedoms), spread = 2 / (9 * n);
  return (std::cbrt(chi_square / (noise * noise) / n) - (1 - spread)) / std::sqrt(spread);
}

Identification identify(const Scene& given, const std::string& log,
                        const IdentificationRequest& request) {
  const Scene scene = scene_with_slopes(given, "identify", without_slopes, true);
  const Assembly assembly = assemble_with_tangents(scene);
  tell_notes(assembly, request.say);
  return identify(scene, assembly, read_log(log, request.noise, scene, assembly), request);
}

Identification identify(const Scene& given, const NamedColumns& log,
                        const IdentificationRequest& request) {
  const Scene scene = scene_with_slopes(given, "identify", without_slopes, true);
  const Assembly assembly = assemble_with_tangents(scene);
  return identify(scene, assembly, log_of(log, request.noise, scene, assembly), request);
}

}  // namespace porthos::scene
