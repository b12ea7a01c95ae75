#include "phs/system/time_transform.h"

#include <algorithm>
#include <type_traits>

namespace porthos::phs {
namespace {

/// The original system's resolvent for steps of sigma(x) dtau. It omits the slope of sigma, which
/// is not stiff, and leaves t and p_t unchanged.
class TransformedResolvent final : public Resolvent {
 public:
  TransformedResolvent(std::unique_ptr<Resolvent> base, const TimeTransformedModel& m,
                       System<double>& system, TimeScale<double>& scale)
      : base_(std::move(base)),
        m_(m),
        system_(system),
        scale_(scale),
        x_(size_t(m.model().description().nx)),
        e_(x_.size()),
        r_(x_.size()) {}
  void factor(double, std::span<const double> z, const Complex4& step) override {
    for (size_t i = 0; i < x_.size(); ++i) x_[i] = z[m_.position(i)];
    system_.gradient(x_, e_);
    base_->factor(z[m_.time_at()], x_, scale_.value(x_, e_) * step);
  }
  void solve(std::span<Complex4> r) override {
    for (size_t i = 0; i < r_.size(); ++i) r_[i] = r[m_.position(i)];
    base_->solve(r_);
    for (size_t i = 0; i < r_.size(); ++i) r[m_.position(i)] = r_[i];
  }

 private:
  std::unique_ptr<Resolvent> base_;
  const TimeTransformedModel& m_;
  System<double>& system_;
  TimeScale<double>& scale_;
  std::vector<double> x_, e_;
  std::vector<Complex4> r_;
};

/// Rows g(x) = 0 of the original system. On the manifold, where K = 0, ∂K/∂p = sigma v and
/// G K_pp Gᵀ = sigma D: what else K_pp has stands beside G v or H + p_t, which are zero there.
template <class T>
class TransformedConstraints final : public Constraints<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  TransformedConstraints(std::unique_ptr<Constraints<T>> base, const TimeTransformedModel& m)
      : base_(std::move(base)),
        m_(m),
        system_(m.model().instantiate<T>()),
        scale_(m.scale().instantiate<T>()),
        x_(size_t(m.model().description().nx)),
        e_(x_) {}
  int count() const override { return base_->count(); }
  void set_time(const T&) override {}  // t is a part of the state, and no row moves
  void place(In z, Out g) override { base_->place(read(z), g); }
  void forces(In lambda, Out Bl) override {
    base_->forces(lambda, x_);
    std::fill(Bl.begin(), Bl.end(), T(0.0));
    for (size_t i = 0; i < x_.size(); ++i) Bl[m_.position(i)] = x_[i];
  }
  void rates(In e, Out g_dot) override { base_->rates(read(e), g_dot); }
  void add_drift(Out) override {}
  void exerted(In lambda, Out reactions) const override { base_->exerted(lambda, reactions); }
  void delassus(In z, Out D) override {
    base_->delassus(read(z), D);
    scale_at();
    for (T& d : D) d = sigma_ * d;
  }
  int factor(In z) override {
    const int rank = base_->factor(read(z));
    scale_at();
    return rank;
  }
  int rank() const override { return base_->rank(); }
  bool uses(int row) const override { return base_->uses(row); }
  void solve(Out r) const override {
    base_->solve(r);
    for (T& x : r) x = x / sigma_;
  }
  void solve_all(Out r, int n) const override {
    base_->solve_all(r, n);
    for (T& x : r) x = x / sigma_;
  }
  void shorten(Out lambda) const override { base_->shorten(lambda); }
  bool unique(int row) const override { return base_->unique(row); }
  double smallest_pivot() const override { return base_->smallest_pivot(); }
  void set_turn_angles(In angles) override {
    base_->set_turn_angles(angles);
    system_->set_turn_angles(angles);
    scale_->set_turn_angles(angles);
  }

 private:
  In read(In z) {
    for (size_t i = 0; i < x_.size(); ++i) x_[i] = z[m_.position(i)];
    return x_;
  }
  /// sigma at x_.
  void scale_at() {
    system_->gradient(x_, e_);
    sigma_ = scale_->value(x_, e_);
  }

  std::unique_ptr<Constraints<T>> base_;
  const TimeTransformedModel& m_;
  std::unique_ptr<System<T>> system_;
  std::unique_ptr<TimeScale<T>> scale_;
  std::vector<T> x_, e_;
  T sigma_ = T(1.0);
};

template <class T>
class TransformedSystem final : public System<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;

 public:
  explicit TransformedSystem(const TimeTransformedModel& m)
      : m_(m),
        base_(m.model().instantiate<T>()),
        scale_(m.scale().instantiate<T>()),
        n_(size_t(m.model().description().nx)),
        closed_(m.model().description().traits.lossless &&
                m.model().description().traits.autonomous),
        x_(n_),
        e_(n_),
        k_(n_),
        a_(n_),
        b_(n_),
        gain_(n_, T(0.0)) {
    turns_.assign(size_t(m.description().angle_count()), T(0.0));
  }

  const Description& description() const override { return m_.description(); }
  std::unique_ptr<System<T>> clone() const override {
    auto copy = std::make_unique<TransformedSystem>(m_);
    if (!turns_.empty()) copy->set_turn_angles(turns_);
    return copy;
  }

  T hamiltonian(In z) override {
    read(z);
    base_->gradient(x_, e_);
    return scale_->value(x_, e_) * (base_->hamiltonian(x_) + z[m_.energy_at()]);
  }
  void gradient(In z, Out out) override {
    const T sigma = read_gradient(z);
    write(k_, out);
    out[m_.time_at()] = T(0.0);
    out[m_.energy_at()] = sigma;
  }
  void field(T, In z, In, Out dz) override {
    const T sigma = read_gradient(z);
    structure(z, T(0.0), sigma, dz);
  }
  void rate(T, In z, In e, Out dz) override { apply_structure(z, e, dz); }
  void powers(T, In z, In, Out values) override {  // of the base, per tau
    const T sigma = read_gradient(z);
    base_->powers(z[m_.time_at()], x_, e_, values);
    for (T& v : values) v = sigma * v;
  }
  void apply_structure(In z, In e, Out Je) override {
    read(z);
    if (!closed_) base_->gradient(x_, e_);
    for (size_t i = 0; i < n_; ++i) k_[i] = e[m_.position(i)];
    structure(z, e[m_.time_at()], e[m_.energy_at()], Je);
  }
  void apply_dissipation(In, In, Out Re) override {
    for (auto& r : Re) r = T(0.0);
  }
  void apply_input(In, In, Out Gu) override {
    for (auto& g : Gu) g = T(0.0);
  }
  void output(In, In, Out) override {}
  void invariants(In, Out) override {}
  void set_turn_angles(In angles) override {
    std::copy(angles.begin(), angles.end(), turns_.begin());
    base_->set_turn_angles(angles);
    scale_->set_turn_angles(angles);
  }
  std::unique_ptr<Resolvent> resolvent() override {
    if constexpr (std::is_same_v<T, double>)
      if (auto base = base_->resolvent())
        return std::make_unique<TransformedResolvent>(std::move(base), m_, *base_, *scale_);
    return nullptr;
  }
  std::unique_ptr<Constraints<T>> constraints() override {
    auto base = base_->constraints();
    if (!base) return nullptr;
    auto rows = std::make_unique<TransformedConstraints<T>>(std::move(base), m_);
    if (!turns_.empty()) rows->set_turn_angles(turns_);
    return rows;
  }

 private:
  void read(In z) {
    for (size_t i = 0; i < n_; ++i) x_[i] = z[m_.position(i)];
  }
  void write(const std::vector<T>& from, Out out) const {
    for (size_t i = 0; i < n_; ++i) out[m_.position(i)] = from[i];
  }
  /// e_ = ∂H/∂x, k_ = ∂K/∂x = sigma e + (H + p_t) ∂sigma/∂x; returns sigma = ∂K/∂p_t.
  T read_gradient(In z) {
    read(z);
    base_->gradient(x_, e_);
    const T sigma = scale_->with_gradient(x_, e_, a_);
    const T excess = base_->hamiltonian(x_) + z[m_.energy_at()];
    for (size_t i = 0; i < n_; ++i) k_[i] = sigma * e_[i] + excess * a_[i];
    return sigma;
  }
  /// out = [J 0 g; 0 0 1; -gᵀ -1 0] (k_, along t, along p_t), with e_ at x_ known where g is not 0.
  void structure(In z, T k_time, T k_energy, Out out) {
    base_->apply_structure(x_, k_, b_);
    T paid(0.0);
    if (!closed_) {
      base_->field(z[m_.time_at()], x_, {}, gain_);
      base_->apply_structure(x_, e_, a_);
      for (size_t i = 0; i < n_; ++i) {
        const T g = gain_[i] - a_[i];
        b_[i] = b_[i] + k_energy * g;
        paid = paid + g * k_[i];
      }
    }
    write(b_, out);
    out[m_.time_at()] = k_energy;
    out[m_.energy_at()] = -k_time - paid;
  }

  const TimeTransformedModel& m_;
  std::unique_ptr<System<T>> base_;
  std::unique_ptr<TimeScale<T>> scale_;
  size_t n_;
  bool closed_;  ///< lossless and autonomous: g = 0
  std::vector<T> x_, e_, k_, a_, b_, gain_, turns_;
};

Description describe(const Description& d, size_t half) {
  Description r;
  const int at = int(half);
  const auto moved = [&](int i) { return i < at ? i : i + 1; };
  r.name = d.name + " in fictitious time";
  r.nx = d.nx + 2;
  for (Block b : d.blocks) {
    b.at = moved(b.at);
    if (b.momentum >= 0) b.momentum = moved(b.momentum);
    r.blocks.push_back(b);
  }
  r.blocks.push_back({"time", BlockKind::linear, at, 1, d.nx + 1, "s", "J"});
  for (const auto& a : d.powers) r.powers.push_back({a.name, PowerKind::observed, a.control});
  r.constraints = d.constraints;
  r.traits.canonical = d.traits.canonical && d.traits.lossless && d.traits.autonomous;
  return r;
}

}  // namespace

TimeTransformedModel::TimeTransformedModel(const Model& model, const TimeScaleModel& scale)
    : model_(model),
      scale_(scale),
      n_(size_t(model.description().nx)),
      half_(model.description().traits.canonical ? n_ / 2 : n_),
      description_(describe(model.description(), half_)) {
  for (const auto& c : model.description().constraints)
    if (c.rolling || c.moving)
      throw InvalidArgument("a step control that transforms time takes no constraint that " +
                            std::string(c.rolling ? "rolls" : "moves") + ", and '" +
                            model.description().name + "' has '" + c.name + "'");
}

template <class T>
std::unique_ptr<System<T>> TimeTransformedModel::make_system() const {
  return std::make_unique<TransformedSystem<T>>(*this);
}
#define PORTHOS_INSTANTIATE(T) \
  template std::unique_ptr<System<T>> TimeTransformedModel::make_system<T>() const;
PORTHOS_FOR_EACH_SCALAR(PORTHOS_INSTANTIATE)
#undef PORTHOS_INSTANTIATE

}  // namespace porthos::phs
