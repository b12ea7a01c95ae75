// The switches of a run with rigid contacts: impacts, closed contacts, where they open.
#include <fmt/format.h>

#include <algorithm>

#include "contact/detail/held_system.h"
#include "contact/detail/resting_forces.h"

namespace porthos::contact {
namespace {

using integrators::Outcome;
using phs::Quad;

/// A contact closes if the jump after its next impact would be lower [m | rad].
constexpr double least_height = 1e-14;
/// Contacts at most so far apart take part in one impact [m | rad].
constexpr double touching = 1e-12;
/// Where two rigid shapes overlap by more, a touch was missed [m | rad].
constexpr double most_overlap = 1e-6;

/// Of a flight that lasts `time` and ends at this speed.
double height(double speed, double time) { return 0.25 * speed * time; }

/// The depth of a free gap, or minus how hard a closed one is pressed.
class RigidSwitches final : public HeldSwitches<RestingModel> {
 public:
  RigidSwitches(std::shared_ptr<RestingModel> model, std::shared_ptr<const phs::Model> part,
                const std::shared_ptr<const phs::Model>& kept)
      : HeldSwitches(std::move(model), std::move(part), kept),
        at_(contacts_),
        exact_(contacts_),
        forces_(contacts_),
        impact_(exact_.gaps.count()),
        quad_angles_(angles_.size()),
        quad_(2 * nq_),
        moved_(nq_),
        used_(at_.count()),
        last_(at_.count()),
        low_(at_.count()),
        loss_at_(powers_of(contacts_.rigid(), ".impact")) {
    for (size_t k = 0; k < at_.count(); ++k)
      e_.push_back(contacts_.rigid()[at_.rigid(k)].restitution);
    const size_t m = at_.count();
    lambda_.reserve(m);
    independent_.reserve(m);
    rates_.reserve(size_t(contacts_.mechanism().nv()));
    jumped_.reserve(100 * m);
  }

  size_t count() const override { return soft_->count() + at_.count(); }

  void at(double t, std::span<const double> x, std::span<const double> turns,
          std::span<double> value) override {
    const size_t soft = soft_->count();
    if (soft > 0) soft_->at(t, x, turns, value.first(soft));
    turn(turns);
    at_.place(x.first(nq_));
    for (size_t k = 0; k < at_.count(); ++k) value[soft + k] = -at_.gap(k);
    if (!model_->holds_any()) return;
    free_->field(t, x, {}, dx_);
    forces_.hold(x, dx_, closed());
    for (size_t k = 0; k < at_.count(); ++k)
      if (closed()[k]) value[soft + k] = -forces_.pressed(k);
  }
  void rates(std::span<const double> x, std::span<const double> turns,
             std::span<double> rate) override {
    turn(turns);
    at_.place(x.first(nq_));
    at_.move(x.first(nq_), x.subspan(nq_, nq_));
    for (size_t k = 0; k < at_.count(); ++k)
      rate[soft_->count() + k] = closed()[k] ? 0 : -at_.rate(k);
  }
  void begin_step(double, State&) override {
    std::fill(last_.begin(), last_.end(), -HUGE_VAL);
    jumped_.clear();
  }

  Outcome jump(size_t k, double t, State& s, std::span<double> works) override {
    k -= soft_->count();
    if (closed()[k]) {
      closed()[k] = 0;
      return Outcome::ok;
    }
    place(s);
    if (double(exact_.gaps.gap(k)) < -most_overlap) return Outcome::failed;
    auto& rows = exact_.rows;
    rows.clear();
    for (size_t j = 0; j < at_.count(); ++j)
      if (j == k || closed()[j] || double(exact_.gaps.gap(j)) <= touching) rows.push_back(j);
    exact_.evaluate(q(), p());
    auto& v = exact_.v;
    Quad fastest(0.0);
    bool bounces = false;
    for (size_t i = 0; i < rows.size(); ++i) {
      const size_t j = rows[i];
      const double approach = -double(v[i]);
      // One that moves apart but came to 0 is pressed, and flies less than rounding.
      low_[i] =
          !closed()[j] && (approach < 0 ? j == k : height(approach, t - last_[j]) < least_height);
      bounces = bounces || (approach > 0 && !low_[i] && !closed()[j]);
      fastest = std::max(fastest, v[i] < Quad(0.0) ? -v[i] : v[i]);
    }
    for (size_t i = 0; i < rows.size(); ++i) {
      if (bounces) low_[i] = 0;
      used_[i] = low_[i] ? 0 : e_[rows[i]];
    }
    impact_.solve(exact_.W, v, std::span<const double>(used_).first(rows.size()),
                  contacts_.rigid()[at_.rigid(k)].simultaneous);
    lambda_.assign(impact_.impulses().begin(), impact_.impulses().end());
    push(s);
    for (size_t i = 0; i < rows.size(); ++i) {
      char& is_closed = closed()[rows[i]];
      const bool leaves = v[i] > Quad(1e-15) * fastest;
      is_closed = (is_closed && !leaves) || (low_[i] && (!leaves || rows[i] == k));
    }
    book(t, works);
    settle(s);
    return Outcome::ok;
  }

  /// Takes the gaps of closed contacts and their rates back to 0, along M⁻¹Gᵀ.
  void settle(State& s) override {
    if (!model_->holds_any()) return;
    place(s);
    auto& rows = exact_.rows;
    rows.clear();
    for (size_t j = 0; j < at_.count(); ++j)
      if (closed()[j]) rows.push_back(j);
    exact_.evaluate(q(), p());
    for (size_t i = 0; i < rows.size(); ++i) exact_.v[i] = exact_.gaps.gap(rows[i]);
    solve();
    rates_.assign(size_t(contacts_.mechanism().nv()), Quad(0.0));
    for (size_t i = 0; i < rows.size(); ++i)
      for (size_t j = 0; j < rates_.size(); ++j) rates_[j] -= exact_.v[i] * exact_.pushed(i)[j];
    mechanics::coordinate_rates<Quad>(contacts_.mechanism(), q(), rates_, moved_);
    for (size_t j = 0; j < nq_; ++j) phs::compensated_add(s.x[j], s.lo[j], double(moved_[j]));
    place(s);
    exact_.evaluate(q(), p());
    solve();
    lambda_.assign(exact_.v.begin(), exact_.v.end());
    for (Quad& l : lambda_) l = -l;
    push(s);
  }
  void carry(Archive& a) override {
    for (char& c : closed()) {
      bool is = c != 0;
      a(is);
      c = is;
    }
  }

 private:
  std::vector<char>& closed() { return model_->held(); }
  std::span<const Quad> q() const { return std::span(quad_).first(nq_); }
  std::span<const Quad> p() const { return std::span(quad_).subspan(nq_); }

  void turn(std::span<const double> turns) {
    if (!is_turned(turns)) return;
    at_.set_turn_angles(angles_);
    forces_.set_turn_angles(angles_);
  }
  /// The state in 113 bits, and the gaps there.
  void place(const State& s) {
    for (size_t i = 0; i < 2 * nq_; ++i) quad_[i] = Quad(s.x[i]) + s.lo[i];
    for (size_t i = 0; i < angles_.size(); ++i)
      quad_angles_[i] = Quad(double(s.turns[i])) * (Quad(phs::two_pi_hi) + phs::two_pi_lo);
    exact_.gaps.set_turn_angles(quad_angles_);
    exact_.gaps.place(q());
  }
  /// W⁻¹ v of the rows into v; rows that depend on others get 0.
  void solve() {
    const size_t m = exact_.rows.size();
    auto& W = exact_.W;
    auto& v = exact_.v;
    std::vector<char>& used = independent_;
    used.assign(m, 1);
    for (size_t i = 0; i < m; ++i) {  // L D Lᵀ in place
      const Quad whole = W[i * m + i];
      for (size_t j = 0; j < i; ++j) {
        if (!used[j]) continue;
        for (size_t k = 0; k < j; ++k)
          if (used[k]) W[i * m + j] -= W[i * m + k] * W[j * m + k] * W[k * m + k];
        W[i * m + j] /= W[j * m + j];
      }
      for (size_t k = 0; k < i; ++k)
        if (used[k]) W[i * m + i] -= W[i * m + k] * W[i * m + k] * W[k * m + k];
      used[i] = W[i * m + i] > Quad(1e-12) * whole;
      if (!used[i]) v[i] = Quad(0.0);
      for (size_t k = 0; used[i] && k < i; ++k)
        if (used[k]) v[i] -= W[i * m + k] * v[k];
    }
    for (size_t i = m; i-- > 0;) {
      if (!used[i]) continue;
      v[i] /= W[i * m + i];
      for (size_t k = i + 1; k < m; ++k)
        if (used[k]) v[i] -= W[k * m + i] * v[k];
    }
  }
  /// p += Gᵀ lambda_.
  void push(State& s) {
    for (size_t j = 0; j < nq_; ++j) {
      Quad sum = quad_[nq_ + j];
      for (size_t i = 0; i < lambda_.size(); ++i) sum += lambda_[i] * exact_.gradient(i)[j];
      s.x[nq_ + j] = double(sum);
      s.lo[nq_ + j] = double(sum - Quad(s.x[nq_ + j]));
    }
  }
  void book(double t, std::span<double> works) {
    for (size_t i = 0; i < exact_.rows.size(); ++i) {
      const size_t j = exact_.rows[i];
      last_[j] = t;
      if (!(impact_.impulses()[i] > Quad(0.0))) continue;
      const size_t power = loss_at_[at_.rigid(j)];
      const double loss = double(impact_.losses()[i]);
      jumped_.push_back({t, power, loss});
      if (works.empty()) continue;
      works[power] += loss;
      works[power + 1] += 1;
    }
  }

  RigidGaps<double> at_;
  RigidRows<Quad> exact_;
  RestingForces forces_;
  RigidImpact<Quad> impact_;
  std::vector<Quad> quad_angles_, quad_, lambda_, rates_;
  std::vector<double> e_;
  std::vector<Quad> moved_;
  std::vector<double> used_;  ///< restitutions of an impact
  std::vector<double> last_;  ///< of each gap, the time of its last impact in this step
  std::vector<char> low_;     ///< of each row of an impact, whether its contact closes
  std::vector<char> independent_;
  std::vector<size_t> loss_at_;  ///< of each rigid contact, its power; the next one counts
};

}  // namespace

std::unique_ptr<integrators::Integrator> with_rigid_contacts(
    const phs::Model& whole, const ContactModel& contacts, double h,
    const std::function<std::unique_ptr<integrators::Integrator>(const phs::Model&)>& make) {
  return held_run<RestingModel, RigidSwitches>(whole, contacts, h, make);
}

}  // namespace porthos::contact
