#include "phs/network/detail/network_resolvent.h"
#include "phs/scalars/derivative.h"

#include <algorithm>
#include <array>

#include "phs/linear_algebra/lane_lu.h"
#include "phs/network/detail/network_ports.h"
#include "phs/network/detail/resistances.h"
#include "phs/network/detail/tank_flows.h"

namespace porthos::phs {
namespace {

using Plan = Network::Plan;
using Numbers = std::span<const double>;
using Written = std::span<double>;
constexpr size_t most_inputs = 128;       ///< W has as many columns
constexpr int most_states_of_an_lu = 32;  ///< of a member without its own resolvent

/// (I - z J)⁻¹ of a small system, J by duals.
class SmallResolvent final : public Resolvent {
 public:
  explicit SmallResolvent(System<Dual>& system)
      : system_(system), lu_(size_t(system.description().nx)), x_(lu_.size()), f_(lu_.size()) {}
  void factor(double t, Numbers x, const Complex4& z) override {
    std::copy(x.begin(), x.end(), x_.begin());
    along_each(x_, [&](size_t j) {
      system_.field(Dual(t), x_, {}, f_);
      for (size_t i = 0; i < f_.size(); ++i)
        lu_.entry(i, j) = Complex4(i == j ? 1.0 : 0.0) - f_[i].d * z;
    });
    lu_.factor();
  }
  void solve(std::span<Complex4> r) override { lu_.solve(r); }

 private:
  System<Dual>& system_;
  LaneLu lu_;
  std::vector<Dual> x_, f_;
};

class NetworkResolvent final : public Resolvent {
  /// An input or a spring: a column of G, and its row of V.
  struct Column {
    size_t member;
    int row;  ///< an input's row, or the momentum that a spring pushes
    bool spring = false;
  };
  /// An entry of ∂²U/∂z² of a spring.
  struct Bend {
    size_t column;   ///< of the spring, or of the number of its block
    size_t row, at;  ///< offsets of the two numbers in the state
    double value = 0;
  };

 public:
  NetworkResolvent(const Plan& plan, std::span<const std::unique_ptr<System<double>>> systems,
                   const std::vector<double>& turns, const std::vector<int>& rows)
      : p_(plan),
        systems_(systems),
        turns_(turns),
        nx_(size_t(plan.nx())),
        nu_(size_t(plan.nu())),
        inputs_(rows.size()),
        slot_(nu_, -1),
        lu_(rows.size() + spring_numbers(plan)),
        dual_turns_(turns.size()),
        x_(nx_),
        e_(nx_),
        y_(nu_),
        u_(nu_, 0.0),
        G_(lu_.size() * nx_, 0.0),
        H_(inputs_ * nx_),
        V_(lu_.size() * nx_),
        C_(inputs_ * inputs_),
        D_(inputs_ * inputs_),
        X_(inputs_ * nx_),
        W_(lu_.size() * nx_),
        t_(lu_.size()) {
    for (const auto& m : p_.members) {
      dual_.push_back(m.model->instantiate<Dual>());
      most_ = std::max(most_, size_t(m.nx));
    }
    xd_.resize(nx_);
    ed_.resize(most_);
    for (size_t i = 0; i < systems_.size(); ++i) {
      own_.push_back(systems_[i]->resolvent());
      if (own_.back()) continue;
      own_.back() = std::make_unique<SmallResolvent>(*dual_[i]);
    }
    for (const int row : rows) {
      slot_[size_t(row)] = int(columns_.size());
      columns_.push_back({member_of_input(row), row});
    }
    for (const auto& s : p_.springs) add_spring(s.q, s.p, 1);
    for (const auto& s : p_.block_springs) add_spring(s.q, s.p, s.size);
    for (const auto& c : p_.controls) {
      seen_.resize(std::max(seen_.size(), size_t(c.size) + c.sensors.size()));
      kappa_.resize(std::max(kappa_.size(), size_t(c.size)));
    }
    law_x_.resize(nx_);
    // Throws here, not in the middle of a run, if a gradient has no duals.
    for (size_t i = 0; i < dual_.size(); ++i)
      dual_[i]->gradient(state(i, std::span<const Dual>(xd_)), std::span(ed_).first(size(i)));
  }

  void factor(double t, Numbers x, const Complex4& z) override {
    z_ = z;
    std::copy(x.begin(), x.end(), x_.begin());
    std::copy(x.begin(), x.end(), xd_.begin());
    tell_turns();
    for (size_t i = 0; i < own_.size(); ++i) own_[i]->factor(t, state(i, x), z);
    evaluate_outputs();
    find_bends();
    find_columns();
    find_rows(t);
    // W = A⁻¹G and S = I - z V W
    for (size_t l = 0; l < columns_.size(); ++l) {
      const size_t i = columns_[l].member, from = offset(i);
      const auto w = state(i, column(W_, l));
      for (size_t k = 0; k < w.size(); ++k) w[k] = Complex4(G_[l * nx_ + from + k]);
      own_[i]->solve(w);
      for (size_t k = 0; k < columns_.size(); ++k) {
        Complex4 sum(0.0);
        for (size_t j = 0; j < w.size(); ++j) sum += V_[k * nx_ + from + j] * w[j];
        lu_.entry(k, l) = Complex4(k == l ? 1.0 : 0.0) - z * sum;
      }
    }
    lu_.factor();
  }

  void solve(std::span<Complex4> r) override {
    for (size_t i = 0; i < own_.size(); ++i) own_[i]->solve(state(i, r));
    for (size_t k = 0; k < columns_.size(); ++k) {
      Complex4 sum(0.0);
      for (size_t j = 0; j < nx_; ++j) sum += V_[k * nx_ + j] * r[j];
      t_[k] = z_ * sum;
    }
    lu_.solve(t_);
    for (size_t l = 0; l < columns_.size(); ++l) {
      const auto w = state(columns_[l].member, column(W_, l)), to = state(columns_[l].member, r);
      for (size_t k = 0; k < w.size(); ++k) to[k] += w[k] * t_[l];
    }
  }

 private:
  size_t offset(size_t i) const { return size_t(p_.members[i].x); }
  size_t size(size_t i) const { return size_t(p_.members[i].nx); }
  template <class Span>
  Span state(size_t i, Span x) const {
    return x.subspan(offset(i), size(i));
  }
  template <class T>
  std::span<T> column(std::vector<T>& of, size_t k) const {
    return std::span(of).subspan(k * nx_, nx_);
  }
  size_t member_of_input(int row) const {
    size_t i = 0;
    while (row >= p_.members[i].u + p_.members[i].nu) ++i;
    return i;
  }
  size_t member_of_state(int k) const {
    size_t i = 0;
    while (k >= p_.members[i].x + p_.members[i].nx) ++i;
    return i;
  }
  double& entry(std::vector<double>& of, int row, int col) const {
    return of[size_t(slot_[size_t(row)]) * inputs_ + size_t(slot_[size_t(col)])];
  }

  void tell_turns() {
    std::copy(turns_.begin(), turns_.end(), dual_turns_.begin());
    for (size_t i = 0; i < dual_.size(); ++i)
      dual_[i]->set_turn_angles(
          std::span<const Dual>(dual_turns_)
              .subspan(size_t(p_.members[i].angle), size_t(p_.members[i].angles)));
  }
  double turn(size_t k) const { return p_.turn_of[k] < 0 ? 0 : turns_[size_t(p_.turn_of[k])]; }
  void add_spring(int q, int p, int size) {
    const size_t first = columns_.size();
    for (int i = 0; i < size; ++i) {
      columns_.push_back({member_of_state(p), p + i, true});
      for (int j = 0; j < size; ++j)
        bends_.push_back({first + size_t(i), size_t(q + i), size_t(q + j)});
    }
  }
  /// U'' of the springs.
  void find_bends() {
    auto bend = bends_.begin();
    for (const auto& s : p_.springs)
      (bend++)->value = derivative(*s.U.slope, x_[size_t(s.q)] + turn(size_t(s.q)));
    for (const auto& s : p_.block_springs) {
      Dual slope[most_of_a_block];
      const auto z = s.of(std::span(xd_));
      const auto n = z.size();
      along_each(z, [&](size_t j) {
        s.U->slope(z, std::span(slope, n));
        for (size_t i = 0; i < n; ++i) bend[long(i * n + j)].value = slope[i].d;
      });
      bend += long(n * n);
    }
  }
  void evaluate_outputs() {
    for (size_t i = 0; i < systems_.size(); ++i) {
      const auto& m = p_.members[i];
      if (m.nu == 0) continue;
      systems_[i]->gradient(state(i, Numbers(x_)), state(i, Written(e_)));
      systems_[i]->output(state(i, Numbers(x_)), state(i, Numbers(e_)),
                          Written(y_).subspan(size_t(m.u), size_t(m.nu)));
    }
  }
  /// G, and H = ∂y/∂x for the same rows.
  void find_columns() {
    for (size_t l = 0; l < columns_.size(); ++l) {
      const Column& c = columns_[l];
      const size_t i = c.member;
      if (c.spring) {
        G_[l * nx_ + size_t(c.row)] = 1;
        continue;
      }
      const auto& m = p_.members[i];
      const Written g = state(i, column(G_, l)), h = column(H_, l);
      u_[size_t(c.row)] = 1;
      systems_[i]->apply_input(state(i, Numbers(x_)),
                               Numbers(u_).subspan(size_t(m.u), size_t(m.nu)), g);
      u_[size_t(c.row)] = 0;
      std::fill(h.begin(), h.end(), 0.0);
      const auto xd = state(i, std::span<Dual>(xd_));
      const auto ed = std::span(ed_).first(size(i));
      for (size_t k = 0; k < g.size(); ++k) xd[k].d = g[k];
      dual_[i]->gradient(xd, ed);
      for (size_t k = 0; k < g.size(); ++k) {
        xd[k].d = 0;
        h[offset(i) + k] = ed[k].d;
      }
    }
    for (const Bend& b : bends_)
      for (size_t l = 0; l < inputs_; ++l) H_[l * nx_ + b.row] += b.value * G_[l * nx_ + b.at];
  }
  /// V = (B + M D) H + M X with D = ∂v/∂y and X = ∂v/∂x; the springs' rows follow.
  void find_rows(double t) {
    std::fill(D_.begin(), D_.end(), 0.0);
    std::fill(X_.begin(), X_.end(), 0.0);
    for (const auto& l : p_.laws) entry(D_, l.row, l.row) -= derivative(*l.law, y_[size_t(l.row)]);
    for (const auto& b : p_.bristles) differentiate(b);
    for (const auto& c : p_.controls)
      if (!c.hold) differentiate(c, t);
    for (const auto& f : p_.filling)
      for (size_t k = 0; k < f.rows.size(); ++k) entry(D_, f.rows[k], f.rows[k]) -= f.d[k];
    std::fill(V_.begin(), V_.end(), 0.0);
    std::fill(C_.begin(), C_.end(), 0.0);
    for (const auto& b : p_.B) entry(C_, b.row, b.col) += b.factor;
    const auto through = [&](size_t row, size_t col, double factor) {
      for (size_t k = 0; k < inputs_; ++k) C_[row * inputs_ + k] += factor * D_[col * inputs_ + k];
      for (size_t k = 0; k < nx_; ++k) V_[row * nx_ + k] += factor * X_[col * nx_ + k];
    };
    if (p_.M.empty())
      for (size_t k = 0; k < inputs_; ++k) through(k, k, 1);
    for (const auto& m : p_.M)
      if (slot_[size_t(m.row)] >= 0 && slot_[size_t(m.col)] >= 0)
        through(size_t(slot_[size_t(m.row)]), size_t(slot_[size_t(m.col)]), m.factor);
    for (size_t k = 0; k < inputs_; ++k)
      for (size_t l = 0; l < inputs_; ++l) {
        const double c = C_[k * inputs_ + l];
        if (c == 0) continue;
        const size_t i = columns_[l].member, from = offset(i);
        for (size_t j = from; j < from + size(i); ++j) V_[k * nx_ + j] += c * H_[l * nx_ + j];
      }
    for (const Bend& b : bends_) V_[b.column * nx_ + b.at] = -b.value;
  }
  /// ∂v/∂y of a bristle into D.
  void differentiate(const Plan::Bristle& b) {
    const std::array rows{b.rate, b.force};
    std::array y{Dual(y_[size_t(b.rate)]), Dual(y_[size_t(b.force)])};
    along_each(y, [&](size_t k) {
      const auto own = bristle_resistance(b.law, y[0], y[1]);
      entry(D_, b.rate, rows[k]) -= (own.rate * y[0]).d;
      entry(D_, b.force, rows[k]) -= (own.slip * y[1]).d;
    });
  }
  /// ∂κ/∂y into D, ∂κ/∂x into X; of a tank its share of now.
  void differentiate(const Plan::Control& c, double t) {
    const auto seen = p_.seen(c);
    const size_t from = seen.first;
    const size_t ports = size_t(c.size), all = ports + c.sensors.size();
    const auto x = std::span(law_x_).first(seen.second);
    auto y = std::span(seen_).first(all);
    const auto u = std::span(kappa_).first(ports);
    for (size_t k = 0; k < x.size(); ++k) x[k] = Dual(x_[from + k] + turn(from + k));
    const double share =
        c.tank < 0 ? 1 : share_of(p_.tanks[size_t(c.tank)], x_[size_t(p_.tanks[size_t(c.tank)].x)]);
    const auto row_seen = [&](size_t k) {
      return k < ports ? c.row + int(k) : c.sensors[k - ports];
    };
    for (size_t k = 0; k < all; ++k) y[k] = Dual(y_[size_t(row_seen(k))]);
    along_each(y, [&](size_t k) {
      (*c.law)(Dual(t), x, y, u);
      for (size_t j = 0; j < ports; ++j) entry(D_, c.row + int(j), row_seen(k)) += share * u[j].d;
    });
    along_each(x, [&](size_t k) {
      (*c.law)(Dual(t), x, y, u);
      for (size_t j = 0; j < ports; ++j)
        X_[size_t(slot_[size_t(c.row) + j]) * nx_ + from + k] += share * u[j].d;
    });
  }

  const Plan& p_;
  std::span<const std::unique_ptr<System<double>>> systems_;
  const std::vector<double>& turns_;
  size_t nx_, nu_, inputs_, most_ = 0;
  std::vector<int> slot_;  ///< per input its column, or -1
  std::vector<Column> columns_;
  std::vector<Bend> bends_;
  std::vector<std::unique_ptr<System<Dual>>> dual_;
  std::vector<std::unique_ptr<Resolvent>> own_;
  LaneLu lu_;  ///< of S
  std::vector<Dual> dual_turns_, xd_, ed_, law_x_, seen_, kappa_;
  std::vector<double> x_, e_, y_, u_;
  std::vector<double> G_, H_, V_, C_, D_, X_;
  std::vector<Complex4> W_, t_;
  Complex4 z_;
};

}  // namespace

std::unique_ptr<Resolvent> make_network_resolvent(
    const Plan& plan, std::span<const std::unique_ptr<System<double>>> systems,
    const std::vector<double>& turns) {
  bool any = false;
  for (size_t i = 0; i < systems.size(); ++i) {
    const bool own = systems[i]->resolvent() != nullptr;
    if (!own && plan.members[i].nx > most_states_of_an_lu) return nullptr;
    any = any || own;
  }
  const auto rows = coupled_rows(plan);
  if (!any || rows.size() + spring_numbers(plan) > most_inputs) return nullptr;
  try {
    return std::make_unique<NetworkResolvent>(plan, systems, turns, rows);
  } catch (const InvalidArgument&) {  // no gradient in duals
    return nullptr;
  }
}

}  // namespace porthos::phs
