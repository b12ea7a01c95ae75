// Porthos beside other libraries: one run, one model, one set of states, the subjects taking turns
// in short batches, the fastest batch of each. A busy machine slows single batches, not the fastest
// of many.
//   porthos_peers [--rounds N] [--json FILE] [--gravity] [--free] URDF...
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bench/chain.h"
#include "bench/peers/subject.h"
#include "mechanics/aba.h"
#include "mechanics/momentum.h"
#include "mechanics/urdf.h"

namespace porthos::bench {
namespace {

using mechanics::Mechanism;

/// One line of the table: what is timed, of whom, and the fastest and the middle batch [ns per
/// state].
struct Timing {
  std::string subject, what;
  std::function<void(int)> call;
  int lanes = 1;
  double best = 0, median = 0;
};

void take_turns(std::vector<Timing>& all, int states, int rounds) {
  using Clock = std::chrono::steady_clock;
  std::vector<std::vector<double>> t(all.size());
  for (int r = -2; r < rounds; ++r)  // two rounds to warm up
    for (size_t k = 0; k < all.size(); ++k) {
      const auto from = Clock::now();
      for (int i = 0; i < states; ++i) {
        all[k].call(i);
        asm volatile("" ::: "memory");
      }
      const std::chrono::duration<double, std::nano> d = Clock::now() - from;
      if (r >= 0) t[k].push_back(d.count() / states / all[k].lanes);
    }
  for (size_t k = 0; k < all.size(); ++k) {
    std::sort(t[k].begin(), t[k].end());
    all[k].best = t[k].front();
    all[k].median = t[k][t[k].size() / 2];
  }
}

/// Field and ABA with a state in every lane of T (double: one state).
template <class T>
void add_field(std::vector<Timing>& all, const Case& c, const std::string& name) {
  constexpr int lanes = phs::lanes<T>;
  struct Run {
    explicit Run(const Mechanism& m) : w(m) {}
    mechanics::Workspace<T> w;
    std::vector<std::vector<T>> q, p, v, tau;
    std::vector<T> q_dot, p_dot, a;
  };
  const auto model = c.model;
  auto r = std::make_shared<Run>(*model);
  mechanics::Workspace<double> w(*model);
  std::vector<Vec> momenta;
  for (size_t s = 0; s < c.q.size(); ++s) {
    momenta.emplace_back(c.q[s].size());
    mechanics::momenta_from_rates<double>(*model, w, c.q[s], c.v[s], momenta.back());
  }
  const auto packed = [&](const std::vector<Vec>& x) {
    std::vector<std::vector<T>> y;
    for (size_t s = 0; s < x.size(); s += size_t(lanes)) {  // the same states, a lane each
      std::vector<T> one(x[s].size());
      for (size_t k = 0; k < one.size(); ++k)
        if constexpr (lanes == 1)
          one[k] = x[s][k];
        else
          for (int l = 0; l < lanes; ++l) one[k].set(l, x[(s + size_t(l)) % x.size()][k]);
      y.push_back(one);
    }
    return y;
  };
  r->q = packed(c.q);
  r->p = packed(momenta);
  r->v = packed(c.v);
  r->tau = packed(c.tau);
  r->q_dot.resize(c.q[0].size());
  r->p_dot.resize(c.q[0].size());
  r->a.resize(size_t(model->nv()));
  const std::string suffix = lanes == 1 ? "" : fmt::format(", {} lanes", lanes);
  all.push_back({name, "field" + suffix,
                 [r, model](int i) {
                   const auto s = size_t(i) % r->q.size();
                   mechanics::hamiltonian_field<T>(*model, r->w, r->q[s], r->p[s], {}, r->q_dot,
                                                   r->p_dot);
                 },
                 lanes});
  if constexpr (lanes > 1)
    all.push_back({name, "aba" + suffix,
                   [r, model](int i) {
                     const auto s = size_t(i) % r->q.size();
                     mechanics::aba<T>(*model, r->w, r->q[s], r->v[s], {r->tau[s], {}}, r->a);
                   },
                   lanes});
}

/// The largest relative difference from the first subject. @throws if it is more than rounding
double check(const std::vector<Subject>& subjects, const Subject& s, const Case& c) {
  double worst = 0;
  const auto compare = [&](const auto& found, const auto& expected, int i, const char* what) {
    if (!found) return;
    const Vec x = found(i), reference = expected(i);
    double e = 0, size = 1;
    for (size_t k = 0; k < reference.size(); ++k) {
      const double d = std::abs(x.at(k) - reference[k]);
      if (!(d <= e)) e = d;  // not a number counts
      size = std::max(size, std::abs(reference[k]));
    }
    e /= size;
    if (!(e < s.tolerance))
      throw std::runtime_error(
          fmt::format("{} of {} on {} differs by {:.1e}", what, s.name, c.model->name(), e));
    worst = std::max(worst, e);
  };
  for (int i = 0; i < c.states(); ++i) {
    compare(s.acceleration, subjects[0].acceleration, i, "forward dynamics");
    compare(s.torque, subjects[0].torque, i, "inverse dynamics");
    compare(s.mass_matrix, subjects[0].mass_matrix, i, "the mass matrix");
    compare(s.torque_slopes, subjects[0].torque_slopes, i, "derivatives of inverse dynamics");
    compare(s.acceleration_slopes, subjects[0].acceleration_slopes, i,
            "derivatives of forward dynamics");
  }
  return worst;
}

nlohmann::json measure(const std::shared_ptr<const Mechanism>& model, const std::string& name,
                       int rounds) {
  const Case c = make_case(model);
  std::vector<Subject> subjects{porthos_subject(c)};
#ifdef PORTHOS_PEER_RBDL
  subjects.push_back(rbdl_subject(c));
#endif
#ifdef PORTHOS_PEER_PINOCCHIO
  subjects.push_back(pinocchio_subject(c));
#endif
#ifdef PORTHOS_PEER_MUJOCO
  subjects.push_back(mujoco_subject(c));
#endif
#ifdef PORTHOS_PEER_DART
  subjects.push_back(dart_subject(c));
#endif
#ifdef PORTHOS_PEER_SIMBODY
  subjects.push_back(simbody_subject(c));
#endif
#ifdef PORTHOS_PEER_BULLET
  subjects.push_back(bullet_subject(c));
#endif
  fmt::print("\n{}: {} bodies, {} freedoms; agreement with Porthos:", name, model->body_count(),
             model->nv());
  for (size_t k = 1; k < subjects.size(); ++k)
    fmt::print(" {} {:.0e}", subjects[k].name, check(subjects, subjects[k], c));
  fmt::print("\n");

  std::vector<Timing> all;
  for (const Subject& s : subjects) {
    if (s.aba) all.push_back({s.name, "aba", s.aba});
    if (s.rnea) all.push_back({s.name, "rnea", s.rnea});
    if (s.crba) all.push_back({s.name, "crba", s.crba});
    if (s.rnea_derivatives) all.push_back({s.name, "RNEA derivatives", s.rnea_derivatives});
    if (s.aba_derivatives) all.push_back({s.name, "ABA derivatives", s.aba_derivatives});
    if (s.hessian) all.push_back({s.name, "Hessian", s.hessian});
  }
  add_field<double>(all, c, subjects[0].name);
  add_field<phs::Pack4>(all, c, subjects[0].name);
  add_field<phs::Pack8>(all, c, subjects[0].name);
  take_turns(all, c.states(), rounds);

  const auto best_peer = [&](const std::string& what) {
    const Timing* best = nullptr;
    for (const Timing& t : all)
      if (t.subject != subjects[0].name && t.what == what && (!best || t.best < best->best))
        best = &t;
    return best;
  };
  nlohmann::json out;
  for (const Timing& t : all) {
    nlohmann::json row{{"model", name},           {"bodies", model->body_count()},
                       {"freedoms", model->nv()}, {"subject", t.subject},
                       {"what", t.what},          {"ns", t.best},
                       {"ns_median", t.median}};
    fmt::print("  {:16} {:16} {:9.1f} ns  (median {:9.1f})", t.subject, t.what, t.best, t.median);
    const bool field = t.what.starts_with("field") || t.what.starts_with("aba");
    const std::string against = field ? "aba" : t.what == "Hessian" ? "ABA derivatives" : t.what;
    if (const Timing* peer = best_peer(against); peer && t.subject == subjects[0].name) {
      fmt::print("  {:.3f} of {}", t.best / peer->best, peer->subject);
      row["ratio"] = t.best / peer->best;
      row["best_peer"] = peer->subject;
    }
    fmt::print("\n");
    out.push_back(row);
  }
  return out;
}

}  // namespace
}  // namespace porthos::bench

int main(int argc, char** argv) try {
  using namespace porthos;
  int rounds = 300;
  std::string json;
  bool free_base = false, gravity = false;
  nlohmann::json rows = nlohmann::json::array();
  for (int i = 1; i < argc; ++i) {
    const std::string a = argv[i];
    if (a == "--rounds" && i + 1 < argc) {
      rounds = std::stoi(argv[++i]);
    } else if (a == "--json" && i + 1 < argc) {
      json = argv[++i];
    } else if (a == "--free" || a == "--fixed") {  // of the files that follow
      free_base = a == "--free";
    } else if (a == "--gravity") {  // likewise; askew, so that every component is checked
      gravity = true;
    } else {
      mechanics::UrdfOptions o;
      o.base = free_base ? mechanics::UrdfOptions::Base::free : mechanics::UrdfOptions::Base::fixed;
      if (gravity) o.gravity = {0.5, -1, -9.81};
      o.links_without_inertia = mechanics::UrdfOptions::NoInertia::massless;
      o.accept_unphysical_inertia = true;
      const auto m =
          std::make_shared<const mechanics::Mechanism>(mechanics::read_urdf(a, o).mechanism);
      for (auto& row : bench::measure(m, std::filesystem::path(a).stem().string(), rounds))
        rows.push_back(row);
    }
  }
  if (!json.empty()) std::ofstream(json) << rows.dump(1) << '\n';
} catch (const std::exception& e) {
  fmt::print(stderr, "porthos_peers: {}\n", e.what());
  return 1;
}
