#pragma once
#include <algorithm>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "phs/system/tunable.h"

/// Systems that wrap other systems.
namespace porthos::phs {

/// The inner system's solver, for a system whose state begins with the inner state. It leaves the
/// rest of the state unchanged. Its J lacks what the outer system adds to the field.
class InnerResolvent final : public Resolvent {
 public:
  InnerResolvent(std::unique_ptr<Resolvent> inner, size_t n) : inner_(std::move(inner)), n_(n) {}
  void factor(double t, std::span<const double> x, const Complex4& z) override {
    inner_->factor(t, x.first(n_), z);
  }
  void solve(std::span<Complex4> r) override { inner_->solve(r.first(n_)); }

 private:
  std::unique_ptr<Resolvent> inner_;
  size_t n_;
};

/// The constraints of the inner system, for a system whose state has it at `from`, and maybe more.
template <class T>
class InnerConstraints final : public Constraints<T> {
 public:
  using In = std::span<const T>;
  using Out = std::span<T>;

  InnerConstraints(std::unique_ptr<Constraints<T>> inner, size_t from, size_t n)
      : inner_(std::move(inner)), from_(from), n_(n) {}
  int count() const override { return inner_->count(); }
  void place(In x, Out g) override { inner_->place(x.subspan(from_, n_), g); }
  void forces(In lambda, Out Bl) override {
    std::fill(Bl.begin(), Bl.end(), T(0.0));
    inner_->forces(lambda, Bl.subspan(from_, n_));
  }
  void set_time(const T& t) override { inner_->set_time(t); }
  void add_drift(std::span<T> g_dot) override { inner_->add_drift(g_dot); }
  void rates(In e, Out g_dot) override { inner_->rates(e.subspan(from_, n_), g_dot); }
  void exerted(In lambda, Out reactions) const override { inner_->exerted(lambda, reactions); }
  void delassus(In x, Out D) override { inner_->delassus(x.subspan(from_, n_), D); }
  int factor(In x) override { return inner_->factor(x.subspan(from_, n_)); }
  int rank() const override { return inner_->rank(); }
  bool uses(int row) const override { return inner_->uses(row); }
  void solve(Out r) const override { inner_->solve(r); }
  void solve_all(Out r, int n) const override { inner_->solve_all(r, n); }
  void shorten(Out lambda) const override { inner_->shorten(lambda); }
  bool unique(int row) const override { return inner_->unique(row); }
  double smallest_pivot() const override { return inner_->smallest_pivot(); }
  void set_turn_angles(In angles) override { inner_->set_turn_angles(angles); }

 private:
  std::unique_ptr<Constraints<T>> inner_;
  size_t from_, n_;
};

/// Forwards every member of System to an inner system. A wrapper overrides only what it changes.
///
/// The state may be longer than the inner state, with which it begins. The base class forwards that
/// part and gives zeros for the rest. It treats the ledger in the same way and takes over declared
/// invariants by name. A wrapper that changes field() must also change rate(), efforts() and
/// resolvent().
template <class T>
class Forwarding : public System<T>, public Tunable<T> {
 public:
  using In = std::span<const T>;
  using Out = std::span<T>;

  /// description: the wrapper's own. It must outlive this object.
  Forwarding(std::unique_ptr<System<T>> inner, const Description& description)
      : inner_(std::move(inner)),
        d_(description),
        n_(size_t(inner_->description().nx)),
        storages_(inner_->description().storages.size()),
        powers_(inner_->description().powers.size()),
        all_(size_t(inner_->description().invariant_count())) {
    turns_.assign(size_t(d_.angle_count()), T(0.0));
    for (const auto& mine : d_.invariants)
      for (const auto& i : inner_->description().invariants)
        if (i.name == mine.name && i.size == mine.size) kept_.push_back({mine.at, i.at, i.size});
  }

  const Description& description() const override { return d_; }
  /// A wrapper returns its own type; see alike().
  std::unique_ptr<System<T>> clone() const override = 0;

  T hamiltonian(In x) override { return inner_->hamiltonian(head(x)); }
  void gradient(In x, Out e) override {
    inner_->gradient(head(x), head(e));
    clear_tail(e);
  }
  void field(T t, In x, In u, Out dx) override {
    inner_->field(t, head(x), u, head(dx));
    clear_tail(dx);
  }
  void rate(T t, In x, In e, Out dx) override {
    inner_->rate(t, head(x), head(e), head(dx));
    clear_tail(dx);
  }
  void efforts(T t, In x, In dx, Out e) override {
    inner_->efforts(t, head(x), head(dx), head(e));
    clear_tail(e);
  }
  void apply_structure(In x, In e, Out Je) override {
    inner_->apply_structure(head(x), head(e), head(Je));
    clear_tail(Je);
  }
  void apply_dissipation(In x, In e, Out Re) override {
    inner_->apply_dissipation(head(x), head(e), head(Re));
    clear_tail(Re);
  }
  void apply_input(In x, In u, Out Gu) override {
    inner_->apply_input(head(x), u, head(Gu));
    clear_tail(Gu);
  }
  void output(In x, In e, Out y) override { inner_->output(head(x), head(e), y); }
  void stored(In x, Out values) override {
    inner_->stored(head(x), values.first(storages_));
    clear(values.subspan(storages_));
  }
  void powers(T t, In x, In e, Out values) override {
    inner_->powers(t, head(x), head(e), values.first(powers_));
    clear(values.subspan(powers_));
  }
  void invariants(In x, Out values) override {
    if (kept_.empty()) return;
    inner_->invariants(head(x), all_);
    for (const auto& k : kept_) std::copy_n(all_.begin() + k.from, k.size, values.begin() + k.at);
  }
  void flow(int k, T t, T h, Out x) override {
    if (k >= int(d_.flows.size())) return System<T>::flow(k, t, h, x);
    inner_->flow(k, t, h, head(x));
  }
  void set_turn_angles(In angles) override {
    std::copy(angles.begin(), angles.end(), turns_.begin());
    inner_->set_turn_angles(angles);
  }
  void use_held(std::span<const HeldPtr> memories) override {
    held_.assign(memories.begin(), memories.end());
    inner_->use_held(memories);
  }
  void sample(size_t i, T t, In x, std::span<double> memory) override {
    inner_->sample(i, t, head(x), memory);
  }
  std::unique_ptr<Constraints<T>> constraints() override {
    auto own = inner_->constraints();
    if (!own || size_t(d_.nx) == n_) return own;
    return std::make_unique<InnerConstraints<T>>(std::move(own), 0, n_);
  }
  std::unique_ptr<Resolvent> resolvent() override {
    return size_t(d_.nx) == n_ ? inner_->resolvent() : near_resolvent();
  }
  std::span<T> parameters() override { return parameters_of(*inner_); }

 protected:
  System<T>& inner() { return *inner_; }
  size_t inner_size() const { return n_; }
  size_t inner_storages() const { return storages_; }
  size_t inner_powers() const { return powers_; }
  In turn_angles() const { return turns_; }

  /// The inner system's part of a vector.
  template <class Span>
  Span head(Span x) const {
    return x.first(n_);
  }
  static void clear(Out values) { std::fill(values.begin(), values.end(), T(0.0)); }
  /// For clone(): gives the copy this object's turn angles and holds and the inner system's
  /// parameters.
  std::unique_ptr<System<T>> alike(std::unique_ptr<Forwarding> copy) const {
    if (!turns_.empty()) copy->set_turn_angles(turns_);
    if (!held_.empty()) copy->use_held(held_);
    const auto from = parameters_of(*inner_);
    std::copy(from.begin(), from.end(), parameters_of(*copy->inner_).begin());
    return copy;
  }
  /// The inner solver for a field that differs from the inner field or has a longer state.
  std::unique_ptr<Resolvent> near_resolvent() {
    auto own = inner_->resolvent();
    if (!own) return nullptr;
    return std::make_unique<InnerResolvent>(std::move(own), n_);
  }

 private:
  struct Kept {
    int at, from, size;
  };
  void clear_tail(Out x) const { clear(x.subspan(n_)); }

  std::unique_ptr<System<T>> inner_;
  const Description& d_;
  size_t n_, storages_, powers_;
  std::vector<T> all_, turns_;
  std::vector<HeldPtr> held_;
  std::vector<Kept> kept_;  ///< inner invariants that are also declared here
};

/// A plant whose inputs u(t, x) the wrapper computes at all ports; no port stays open. State: the
/// plant's. Ledger: the plant's, then the power of the inputs.
template <class T>
class Driven : public Forwarding<T> {
 public:
  using typename Forwarding<T>::In;
  using typename Forwarding<T>::Out;

  Driven(std::unique_ptr<System<T>> plant, const Description& description)
      : Forwarding<T>(std::move(plant), description),
        y_(size_t(this->inner().description().nu)),
        work_(size_t(description.nx)) {}

  void field(T t, In x, In, Out dx) override { this->inner().field(t, x, inputs(t, x), dx); }
  void rate(T t, In x, In e, Out dx) override {
    this->inner().rate(t, x, e, dx);
    this->inner().apply_input(x, inputs(t, x), work_);
    for (size_t i = 0; i < dx.size(); ++i) dx[i] = dx[i] + work_[i];
  }
  void efforts(T t, In x, In dx, Out e) override {
    this->inner().apply_input(x, inputs(t, x), work_);
    for (size_t i = 0; i < dx.size(); ++i) work_[i] = dx[i] - work_[i];
    this->inner().efforts(t, x, work_, e);
  }
  void apply_input(In, In, Out Gu) override { this->clear(Gu); }
  void output(In, In, Out) override {}
  void powers(T t, In x, In e, Out values) override {
    Forwarding<T>::powers(t, x, e, values);
    this->inner().output(x, e, y_);
    const In u = inputs(t, x);
    T sum(0.0);
    for (size_t i = 0; i < u.size(); ++i) sum = sum + u[i] * y_[i];
    values[this->inner_powers()] = sum;
  }
  std::unique_ptr<Resolvent> resolvent() override { return this->near_resolvent(); }

 protected:
  /// u(t, x), one number per input of the plant. Valid until the next call.
  virtual In inputs(T t, In x) = 0;

 private:
  std::vector<T> y_, work_;
};

}  // namespace porthos::phs
