#include "planning/problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "phs/functions/pieces.h"
#include "planning/detail/gauss_interval.h"

namespace porthos::planning {
namespace {

void check_list(const char* what, const std::vector<double>& list, int size) {
  if (!list.empty()) require_size(what, list.size(), size_t(size));
}

void check_bounds(const char* what, const std::vector<double>& lower,
                  const std::vector<double>& upper) {
  for (size_t k = 0; k < lower.size() && k < upper.size(); ++k)
    if (!(lower[k] < upper[k]))
      throw InvalidArgument(
          fmt::format("limits of {} {}: lower is {}, upper {}, expected lower < "
                      "upper",
                      what, k, lower[k], upper[k]));
}

void check_goal(const Goal& g, int nx) {
  if (!std::isfinite(g.value))
    throw InvalidArgument(fmt::format("a goal has the value {}, expected a number", g.value));
  if (int(!g.row.empty()) + int(g.rate >= 0) + int(bool(g.number)) != 1)
    throw InvalidArgument("a goal has several of a row, a rate and a number or none, expected one");
  const auto inside = [&](int k) {
    if (k < 0 || k >= nx)
      throw InvalidArgument(
          fmt::format("a goal names state number {}, expected 0 to {}", k, nx - 1));
  };
  if (g.rate >= 0) inside(g.rate);
  for (const auto& [k, factor] : g.row) inside(k);
}

/// The polynomial through the inputs of an interval at its stages, at the fraction theta.
void inputs_at(const Problem& p, const std::vector<double>& nodes, const double* w, double theta,
               double* u) {
  const int nu = p.dynamics->nu(), s = p.inputs == Inputs::held ? 1 : p.stages;
  for (int a = 0; a < nu; ++a) u[a] = 0;
  for (int i = 0; i < s; ++i) {
    double basis = 1;
    for (int j = 0; j < s; ++j)
      if (j != i) basis *= (theta - nodes[size_t(j)]) / (nodes[size_t(i)] - nodes[size_t(j)]);
    for (int a = 0; a < nu; ++a) u[a] += basis * w[i * nu + a];
  }
}

}  // namespace

void Problem::check() const {
  if (!dynamics) throw InvalidArgument("a problem has no dynamics");
  const int nx = dynamics->nx(), nu = dynamics->nu();
  if (nu < 1) throw InvalidArgument("a problem has no inputs, expected one or more to plan");
  if (stages < 1 || stages > 8)
    throw InvalidArgument(fmt::format("stages is {}, expected 1 to 8", stages));
  if (intervals < 1)
    throw InvalidArgument(fmt::format("intervals is {}, expected 1 or more", intervals));
  if (!(duration > 0 && std::isfinite(duration)))
    throw InvalidArgument(fmt::format("duration is {} s, expected more than 0", duration));
  require_size("start", start.size(), size_t(nx));
  check_list("input weights", cost.input, nu);
  check_list("rate weights", cost.rate, nx);
  for (const auto* weights : {&cost.input, &cost.rate})
    for (const double w : *weights)
      if (!(w >= 0)) throw InvalidArgument(fmt::format("a weight is {}, expected 0 or more", w));
  for (const auto& d : cost.drawn) {
    if (d.input < 0 || d.input >= nu || d.rate < 0 || d.rate >= nx)
      throw InvalidArgument("drawn power names an input or a rate that does not exist");
    if (!(d.weight >= 0 && d.smoothing > 0))
      throw InvalidArgument(
          fmt::format("drawn power has weight {} and smoothing {} W, expected 0 "
                      "or more, and more than 0",
                      d.weight, d.smoothing));
  }
  for (const auto& g : goals) check_goal(g, nx);
  check_list("lower limits of inputs", limits.input_lower, nu);
  check_list("upper limits of inputs", limits.input_upper, nu);
  check_list("lower limits of states", limits.state_lower, nx);
  check_list("upper limits of states", limits.state_upper, nx);
  check_list("limits of rates", limits.rate, nx);
  for (const double r : limits.rate)
    if (!(r > 0))
      throw InvalidArgument(fmt::format("a limit of a rate is {}, expected more than 0", r));
  for (const PathLimit& l : limits.path)
    if (!l.number || !(l.lower < l.upper))
      throw InvalidArgument(
          fmt::format("a limit of a path is from {} to {}, expected a number with lower < upper",
                      l.lower, l.upper));
  check_bounds("input", limits.input_lower, limits.input_upper);
  check_bounds("state", limits.state_lower, limits.state_upper);
}

std::vector<Goal> attitude_goals(int at, const std::array<double, 4>& g) {
  std::vector<Goal> goals;
  for (int i = 1; i <= 3; ++i) {  // g_0 ξ - ξ_0 g - g × ξ
    const int j = i % 3 + 1, k = j % 3 + 1;
    goals.push_back({{{at + i, 2 * g[0]},
                      {at, -2 * g[size_t(i)]},
                      {at + k, -2 * g[size_t(j)]},
                      {at + j, 2 * g[size_t(k)]}},
                     -1,
                     0});
  }
  return goals;
}

void check_guess(const Problem& problem, const Trajectory& guess) {
  problem.check();
  const size_t N = size_t(problem.intervals);
  require_size("states of the guess", guess.x.size(), (N + 1) * problem.start.size());
  require_size("inputs of the guess", guess.u.size(), N * size_t(problem.per_interval()));
}

Trajectory straight(const Problem& p, const std::vector<double>& end) {
  const size_t n = p.start.size(), N = size_t(p.intervals);
  require_size("end", end.size(), n);
  Trajectory t{std::vector<double>((N + 1) * n),
               std::vector<double>(N * size_t(p.per_interval()), 0.0)};
  for (size_t k = 0; k <= N; ++k)
    for (size_t i = 0; i < n; ++i)
      t.x[k * n + i] = p.start[i] + (end[i] - p.start[i]) * double(k) / double(N);
  return t;
}

void follow_inputs(const Problem& p, Trajectory& t) {
  p.check();
  const size_t n = p.start.size(), nw = size_t(p.per_interval());
  require_size("inputs", t.u.size(), size_t(p.intervals) * nw);
  const auto table = integrators::gauss_table<double>(p.stages);
  t.x = p.start;
  for (int k = 0; k < p.intervals; ++k) {
    detail::GaussInterval interval(p, table, k);
    if (!interval.solve(t.x.data() + size_t(k) * n, t.u.data() + size_t(k) * nw))
      throw InvalidArgument(fmt::format(
          "the step at t = {} s does not converge, expected smaller inputs or more intervals",
          k * p.step()));
    t.x.insert(t.x.end(), interval.end().begin(), interval.end().end());
  }
}

phs::FunctionPtr input_signal(const Problem& p, const Trajectory& t, int input) {
  const int nu = p.dynamics->nu();
  if (input < 0 || input >= nu)
    throw InvalidArgument(fmt::format("input is {}, expected 0 to {}", input, nu - 1));
  require_size("inputs of the trajectory", t.u.size(), size_t(p.intervals * p.per_interval()));
  std::vector<double> values;
  for (size_t i = size_t(input); i < t.u.size(); i += size_t(nu)) values.push_back(t.u[i]);
  const auto nodes = p.inputs == Inputs::held ? std::vector<double>{0.5}
                                              : integrators::gauss_table<double>(p.stages).c;
  return phs::pieces(p.step(), nodes, std::move(values));
}

Trajectory resample(const Problem& from, const Trajectory& t, const Problem& to) {
  from.check();
  to.check();
  const size_t n = from.start.size(), nw = size_t(from.per_interval());
  const int nu = to.dynamics->nu();
  require_size("start of the other problem", to.start.size(), n);
  require_size("inputs of the trajectory", t.u.size(), size_t(from.intervals) * nw);
  require_size("states of the trajectory", t.x.size(), size_t(from.intervals + 1) * n);
  const auto table = integrators::gauss_table<double>(from.stages),
             target = integrators::gauss_table<double>(to.stages);
  std::vector<detail::GaussInterval> intervals;
  intervals.reserve(size_t(from.intervals));
  for (int k = 0; k < from.intervals; ++k) {
    intervals.emplace_back(from, table, k);
    if (!intervals.back().solve(t.x.data() + size_t(k) * n, t.u.data() + size_t(k) * nw))
      throw InvalidArgument(fmt::format("the step at t = {} s does not converge", k * from.step()));
  }
  /// The interval of a fraction of the whole duration, and the fraction inside.
  const auto place = [&](double part) {
    const int k = std::clamp(int(part * from.intervals), 0, from.intervals - 1);
    return std::pair(size_t(k), part * from.intervals - k);
  };
  Trajectory r;
  for (int k = 0; k <= to.intervals; ++k) {
    const auto [i, theta] = place(double(k) / to.intervals);
    const auto x = intervals[i].value(theta);
    r.x.insert(r.x.end(), x.begin(), x.end());
  }
  r.u.resize(size_t(to.intervals * to.per_interval()));
  double* u = r.u.data();
  for (int k = 0; k < to.intervals; ++k)
    for (int j = 0; j < to.per_interval() / nu; ++j, u += nu) {
      const double c = to.inputs == Inputs::held ? 0.5 : target.c[size_t(j)];
      const auto [i, theta] = place((k + c) / to.intervals);
      inputs_at(from, table.c, t.u.data() + i * nw, theta, u);
    }
  return r;
}

}  // namespace porthos::planning
