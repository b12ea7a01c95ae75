#include "energy_shaping/certify/sweep.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include "energy_shaping/certify/detail/held_offset.h"
#include "energy_shaping/loop/derivatives.h"
#include "energy_shaping/loop/run.h"
#include "energy_shaping/loop/runge_kutta.h"
#include "mechanics/crba.h"
#include "phs/error.h"
#include "phs/linear_algebra/dense.h"
#include "phs/linear_algebra/linear_algebra.h"
#include "phs/nearest.h"

namespace porthos::energy_shaping {
namespace {

using phs::Pack8;
using Lanes = std::vector<Pack8>;

/// The loop with the gains of one run.
class OneLoop {
 public:
  explicit OneLoop(const ClosedLoop& loop)
      : loop_(loop), plain_(loop.loop<double>()), dual_(loop.loop<phs::Dual>()) {}
  void take(const std::vector<double>& gains) {
    std::ranges::copy(gains, plain_->gains().begin());
    for (size_t i = 0; i < gains.size(); ++i) dual_->gains()[i] = phs::Dual(gains[i]);
  }
  /// The largest |eigenvalue| of the field's Jacobian [1/s].
  double fastest(const std::vector<double>& x) {
    double most = 0;
    for (const auto& each : phs::spectrum(x.size(), field_jacobian(*dual_, x)).rest)
      most = std::max(most, std::abs(each));
    return most;
  }
  bool elsewhere(const std::vector<double>& x, double left, double begun) {
    return HeldOffset(loop_, *plain_, hessian(*dual_, loop_.rest())).elsewhere(x, left, begun);
  }

 private:
  const ClosedLoop& loop_;
  std::unique_ptr<LoopSystem<double>> plain_;
  std::unique_ptr<LoopSystem<phs::Dual>> dual_;
};

/// Eight runs.
class Runs {
 public:
  Runs(const ClosedLoop& loop, const SweepOptions& o)
      : loop_(loop),
        o_(o),
        system_(loop.loop<Pack8>()),
        one_loop_(loop),
        n_(o.start.size()),
        x_(n_),
        u_(size_t(loop.plant().description().nu)),
        less_(u_),
        one_(n_),
        kutta_(n_) {}

  /// of_rows: parts_of_step()
  void run(const std::vector<std::vector<double>>& gains, const std::vector<std::int64_t>& of_rows,
           size_t first, std::vector<SweepResult>& results) {
    const size_t lanes = std::min<size_t>(8, gains.size() - first);
    const auto k = system_->gains();
    for (size_t l = 0; l < 8; ++l)  // a lane without a run repeats the last
      for (size_t i = 0; i < k.size(); ++i)
        k[i].set(int(l), gains[first + std::min(l, lanes - 1)][i]);
    const std::int64_t parts =
        *std::max_element(of_rows.begin() + long(first), of_rows.begin() + long(first + lanes));
    Lanes at_rest(n_);
    for (size_t i = 0; i < n_; ++i) {
      at_rest[i] = Pack8(loop_.rest()[i]);
      x_[i] = Pack8(o_.start[i]);
    }
    const Pack8 rest = system_->hamiltonian(at_rest);
    const Pack8 first_energy = system_->hamiltonian(x_) - rest;
    Pack8 peak(0.0), settling(0.0), excursion(0.0), energy = first_energy;
    const auto steps = std::int64_t(std::llround(o_.duration / o_.step));
    bool defined[8];
    std::fill_n(defined, 8, true);
    for (std::int64_t s = 0; s < steps; ++s) {
      still(lanes, defined);
      for (std::int64_t part = 0; part < parts; ++part) {
        inputs(peak);
        step(o_.step / double(parts));
      }
      energy = system_->hamiltonian(x_) - rest;
      const auto unsettled = !(energy <= Pack8(o_.settled) * first_energy);
      settling = select(unsettled, Pack8(double(s + 1) * o_.step), settling);
      for (size_t i = 0; i < n_ / 2; ++i)
        excursion = phs::max(excursion, phs::abs(x_[i] - Pack8(loop_.rest()[i])));
    }
    still(lanes, defined);
    for (size_t l = 0; l < lanes; ++l) {
      auto& r = results[first + l];
      const int lane = int(l);
      r.gains = gains[first + l];
      r.residual = energy[lane] / first_energy[lane];
      r.finite = std::isfinite(r.residual);
      r.peak = peak[lane];
      r.max_excursion = excursion[lane];
      r.defined = defined[l];
      const bool down = r.finite && r.residual <= o_.settled;
      if (down && r.defined) {
        one_loop_.take(r.gains);
        for (size_t i = 0; i < n_; ++i) one_[i] = x_[i][lane];
        r.elsewhere = one_loop_.elsewhere(one_, energy[lane], first_energy[lane]);
      }
      const bool settles = down && r.defined && !r.elsewhere;
      r.settling =
          settles && settling[lane] < o_.duration - 0.5 * o_.step ? settling[lane] : HUGE_VAL;
    }
  }

 private:
  /// Of runs within their law's domain up to here: which are there now.
  void still(size_t lanes, bool* defined) {
    for (size_t l = 0; l < lanes; ++l) {
      if (!defined[l]) continue;
      for (size_t i = 0; i < n_; ++i) one_[i] = x_[i][int(l)];
      defined[l] = loop_.hindrance(one_).empty();
    }
  }
  void inputs(Pack8& peak) {
    system_->law(Pack8(0.0), x_, u_);
    limit();
    for (const int a : loop_.actuated()) peak = phs::max(peak, phs::abs(u_[size_t(a)]));
  }
  /// Of the law's u what the actuators give; what they do not is in less_.
  void limit() {
    for (size_t j = 0; j < o_.limits.size(); ++j) {
      const auto a = size_t(loop_.actuated()[j]);
      const Pack8 most(o_.limits[j]), given = phs::max(phs::min(u_[a], most), -most);
      less_[a] = given - u_[a];
      u_[a] = given;
    }
  }
  void step(double h) {
    kutta_.step(h, x_, [&](const Lanes& x, Lanes& dx) {
      if (o_.limits.empty()) return system_->field(Pack8(0.0), x, {}, dx);
      system_->law(Pack8(0.0), x, u_);
      limit();
      system_->field(Pack8(0.0), x, less_, dx);
    });
  }

  const ClosedLoop& loop_;
  const SweepOptions& o_;
  std::unique_ptr<LoopSystem<Pack8>> system_;
  OneLoop one_loop_;
  size_t n_;
  Lanes x_, u_, less_;
  std::vector<double> one_;
  RungeKutta<Pack8> kutta_;
};

/// In how many parts a step is taken with each row of gains, so that the fastest motion of the
/// linearised loop moves by no more than itself in each: an explicit method explodes beyond 2.8
/// times.
std::vector<std::int64_t> parts_of_step(const ClosedLoop& loop,
                                        const std::vector<std::vector<double>>& gains,
                                        const SweepOptions& o) {
  constexpr double most = 1000;
  OneLoop one(loop);
  std::vector<std::int64_t> parts;
  for (const auto& row : gains) {
    one.take(row);
    const double fastest = std::max(one.fastest(loop.rest()), one.fastest(o.start));
    if (fastest * o.step > most)
      throw InvalidArgument(fmt::format(
          "gains {::.4g} make a motion of {:.2g} rad/s, expected steps of at most {:.1g} s for it, "
          "not {:g} s",
          row, fastest, most / fastest, o.step));
    const double each = std::isfinite(fastest) ? std::ceil(fastest * o.step) : 1;
    parts.push_back(std::max<std::int64_t>(1, std::int64_t(each)));
  }
  return parts;
}

}  // namespace

std::vector<SweepResult> sweep(const ClosedLoop& loop,
                               const std::vector<std::vector<double>>& gains,
                               const SweepOptions& o) {
  const auto names = loop.gain_names();
  if (names.empty())
    throw InvalidArgument("'" + loop.description().name + "' has no gains that could be swept");
  for (const auto& row : gains) require_size("a row of gains", row.size(), names.size());
  require_size("start state", o.start.size(), size_t(loop.description().nx));
  check_limits(loop, o.limits);
  if (!(o.step > 0) || !(o.duration > 0))
    throw InvalidArgument("a sweep needs a step and a duration > 0");
  std::vector<SweepResult> results(gains.size());
  const auto parts = parts_of_step(loop, gains, o);
  std::atomic<size_t> next{0};
  const auto work = [&] {
    Runs runs(loop, o);
    for (size_t first; (first = next.fetch_add(8)) < gains.size();)
      runs.run(gains, parts, first, results);
  };
  const int threads =
      o.threads > 0 ? o.threads : std::max(1, int(std::thread::hardware_concurrency()));
  std::vector<std::thread> team;
  for (int i = 1; i < threads; ++i) team.emplace_back(work);
  work();
  for (auto& t : team) t.join();
  return results;
}

std::vector<std::vector<double>> grid_of(const std::vector<std::vector<double>>& values) {
  std::vector<std::vector<double>> rows{{}};
  for (const auto& list : values) {
    std::vector<std::vector<double>> longer;
    for (const auto& row : rows)
      for (const double v : list) {
        longer.push_back(row);
        longer.back().push_back(v);
      }
    rows = std::move(longer);
  }
  return rows;
}

std::vector<double> logarithmic(double low, double high, int count) {
  if (!(low > 0 && high > 0))
    throw InvalidArgument(
        fmt::format("logarithmic values from {:g} to {:g}, expected both above 0", low, high));
  std::vector<double> v;
  for (int i = 0; i < count; ++i)
    v.push_back(low * std::pow(high / low, count > 1 ? double(i) / (count - 1) : 0.0));
  return v;
}

int fastest(const std::vector<SweepResult>& results, double limit) {
  int best = -1;
  for (size_t i = 0; i < results.size(); ++i)
    if (results[i].peak <= limit && std::isfinite(results[i].settling) &&
        (best < 0 || results[i].settling < results[size_t(best)].settling))
      best = int(i);
  return best;
}

std::vector<double> felt_masses(const mechanics::MechanicalModel& model,
                                const std::vector<double>& q) {
  const auto& m = model.mechanism();
  require_size("q", q.size(), size_t(m.nq()));
  const size_t nv = size_t(m.nv());
  mechanics::Workspace<double> w(m);
  std::vector<double> M(nv * nv), felt(q.size(), 0.0);
  mechanics::crba<double>(m, w, q, M);
  const bool floating =
      m.coordinates().front().node == 0 && m.coordinates().front().nq != 1 && nv > 6;
  double L[36], Mbb[36], column[6], y[6];
  if (floating) {
    for (size_t i = 0; i < 6; ++i)
      for (size_t j = 0; j < 6; ++j) Mbb[i * 6 + j] = M[i + nv * j];
    phs::dense::cholesky(size_t(6), Mbb, L);
  }
  for (const auto& c : m.coordinates()) {
    if (c.nq != 1) continue;
    const size_t v = size_t(c.v);
    double& mass = felt[size_t(c.q)];
    mass = M[v + nv * v];
    if (!floating) continue;
    for (size_t i = 0; i < 6; ++i) column[i] = M[i + nv * v];
    phs::dense::solve(size_t(6), L, column, y);
    mass -= phs::dense::dot(size_t(6), column, y);
  }
  return felt;
}

namespace {

/// The ports that are meant by their own name or by that of their joint.
Names ports_meant(const std::vector<phs::Port>& ports, const std::vector<std::string>& names) {
  Names meant, known;
  for (const auto& p : ports) known.emplace_back(p.name);
  for (const std::string& name : names) {
    const auto port = std::ranges::find_if(
        known, [&](std::string_view p) { return p == name || p.substr(0, p.rfind('.')) == name; });
    if (port == known.end())
      throw InvalidArgument(fmt::format(
          "joint regulation is to skip '{}', expected a port or its joint, {}", name,
          known.empty()      ? "of which there are none"
          : known.size() > 4 ? fmt::format("as '{}', the nearest name", nearest(name, known))
                             : fmt::format("of: {}", fmt::join(known, ", "))));
    meant.push_back(*port);
  }
  return meant;
}

}  // namespace

PotentialShaping joint_regulation(const mechanics::MechanicalModel& model, std::vector<double> rest,
                                  double bandwidth, double damping_ratio,
                                  const std::vector<std::string>& skip) {
  const auto& m = model.mechanism();
  if (!(bandwidth > 0) || !(damping_ratio > 0))
    throw InvalidArgument("joint regulation needs a bandwidth and a damping ratio > 0");
  const auto felt = felt_masses(model, rest);
  const auto& ports = model.description().ports;
  const Names skipped = ports_meant(ports, skip);
  PotentialShaping s;
  s.name = "joint regulation";
  for (const auto& port : ports) {
    if (port.size != 1) continue;
    const auto c = std::find_if(m.coordinates().begin(), m.coordinates().end(),
                                [&](const auto& k) { return k.v == port.at && k.nq == 1; });
    if (c == m.coordinates().end() || std::ranges::count(skipped, port.name)) continue;
    const auto gains = bandwidth_gains(felt[size_t(c->q)], bandwidth, damping_ratio);
    s.joints.push_back({port.name, gains.stiffness, rest[size_t(c->q)]});
    s.damping.push_back({port.name, {gains.damping}});
    s.actuators.push_back(port.name);
  }
  s.rest = std::move(rest);
  return s;
}

}  // namespace porthos::energy_shaping
