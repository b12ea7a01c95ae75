#pragma once
#include <memory>
#include <vector>

#include "phs/network/detail/network_plan.h"

namespace porthos::phs {

/// The constraints of a network's members, one after another. Private to network*.cpp.
template <class T>
class NetworkConstraints final : public Constraints<T> {
  using In = std::span<const T>;
  using Out = std::span<T>;
  struct Part {
    std::unique_ptr<Constraints<T>> rows;
    size_t x, nx, angle, angles;  ///< the member's slices of the state and of its turn angles
    size_t at, size;              ///< of its rows
    size_t reaction, reactions;   ///< what they exert
  };

 public:
  void add(const Network::Plan::Member& m, std::unique_ptr<Constraints<T>> rows, size_t reactions) {
    const size_t size = size_t(rows->count());
    parts_.push_back({std::move(rows), size_t(m.x), size_t(m.nx), size_t(m.angle), size_t(m.angles),
                      size_, size, reactions_, reactions});
    size_ += size;
    reactions_ += reactions;
  }
  bool empty() const { return parts_.empty(); }

  int count() const override { return int(size_); }
  void set_time(const T& t) override {
    for (auto& p : parts_) p.rows->set_time(t);
  }
  void place(In x, Out g) override {
    for (auto& p : parts_) p.rows->place(x.subspan(p.x, p.nx), g.subspan(p.at, p.size));
  }
  void forces(In lambda, Out Bl) override {
    std::fill(Bl.begin(), Bl.end(), T(0.0));
    for (auto& p : parts_) p.rows->forces(lambda.subspan(p.at, p.size), Bl.subspan(p.x, p.nx));
  }
  void rates(In e, Out g_dot) override {
    for (auto& p : parts_) p.rows->rates(e.subspan(p.x, p.nx), g_dot.subspan(p.at, p.size));
  }
  void add_drift(Out g_dot) override {
    for (auto& p : parts_) p.rows->add_drift(g_dot.subspan(p.at, p.size));
  }
  void exerted(In lambda, Out reactions) const override {
    for (const auto& p : parts_)
      p.rows->exerted(lambda.subspan(p.at, p.size), reactions.subspan(p.reaction, p.reactions));
  }
  void delassus(In x, Out D) override {
    std::fill(D.begin(), D.end(), T(0.0));
    for (auto& p : parts_) {
      std::vector<T> own(p.size * p.size);
      p.rows->delassus(x.subspan(p.x, p.nx), own);
      for (size_t i = 0; i < p.size; ++i)
        for (size_t j = 0; j < p.size; ++j) D[(p.at + i) * size_ + p.at + j] = own[i * p.size + j];
    }
  }
  int factor(In x) override {
    for (auto& p : parts_) p.rows->factor(x.subspan(p.x, p.nx));
    return rank();
  }
  int rank() const override {
    int sum = 0;
    for (const auto& p : parts_) sum += p.rows->rank();
    return sum;
  }
  bool uses(int row) const override { return part(row).rows->uses(row - int(part(row).at)); }
  bool unique(int row) const override { return part(row).rows->unique(row - int(part(row).at)); }
  void solve(Out r) const override {
    for (const auto& p : parts_) p.rows->solve(r.subspan(p.at, p.size));
  }
  void solve_all(Out r, int n) const override {
    for (const auto& p : parts_)
      p.rows->solve_all(r.subspan(p.at * size_t(n), p.size * size_t(n)), n);
  }
  void shorten(Out lambda) const override {
    for (const auto& p : parts_) p.rows->shorten(lambda.subspan(p.at, p.size));
  }
  double smallest_pivot() const override {
    double least = 1;
    for (const auto& p : parts_) least = std::min(least, p.rows->smallest_pivot());
    return least;
  }
  void set_turn_angles(In angles) override {
    for (auto& p : parts_) p.rows->set_turn_angles(angles.subspan(p.angle, p.angles));
  }

 private:
  const Part& part(int row) const {
    size_t i = 0;
    while (i + 1 < parts_.size() && size_t(row) >= parts_[i + 1].at) ++i;
    return parts_[i];
  }

  std::vector<Part> parts_;
  size_t size_ = 0, reactions_ = 0;
};

/// Those of a network's systems, or null if none has any.
template <class T>
std::unique_ptr<Constraints<T>> make_network_constraints(
    const Network::Plan& plan, const std::vector<std::unique_ptr<System<T>>>& systems) {
  auto all = std::make_unique<NetworkConstraints<T>>();
  for (size_t i = 0; i < systems.size(); ++i)
    if (auto rows = systems[i]->constraints())
      all->add(plan.members[i], std::move(rows),
               size_t(systems[i]->description().reaction_count()));
  if (all->empty()) return nullptr;
  return all;
}

}  // namespace porthos::phs
