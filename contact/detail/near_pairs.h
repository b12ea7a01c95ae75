#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "contact/contact.h"
#include "contact/detail/neighbours.h"

namespace porthos::contact {

/// The pairs of a model's rigid contacts that can touch while the surfaces move from one place to
/// another, in the order of ContactModel::all_rigid().
class NearPairs {
 public:
  explicit NearPairs(const ContactModel& model) : model_(model), sides_(model.rigid_sides()) {
    placed_.seats = model.rigid_seats().seats;
    placed_.stops = model.rigid_seats().stops;
    bounds_.resize(placed_.seats.size());
    of_.resize(placed_.seats.size());
    std::uint64_t number = 0;
    for (size_t k = 0; k < sides_.size(); ++k) {
      first_.push_back(number);
      number += std::uint64_t(sides_[k].a.size()) * sides_[k].b.size();
      for (size_t i = 0; i < sides_[k].a.size(); ++i) of_[sides_[k].a[i]].a.push_back({k, i});
      for (size_t i = 0; i < sides_[k].b.size(); ++i) of_[sides_[k].b[i]].b.push_back({k, i});
    }
    first_.push_back(number);
  }

  /// Those whose surfaces come together, or would if only one of the two moved. start, end: of the
  /// seats in the world.
  void find(std::span<const Pose> start, std::span<const Pose> end) {
    for (size_t k = 0; k < bounds_.size(); ++k)
      bounds_[k] = {start[k].r, placed_.seats[k].shape.reach() + moved(start[k], end[k])};
    found_.clear();
    neighbours_.find(bounds_, [&](size_t a, size_t b) {
      if (placed_.seats[a].node == placed_.seats[b].node || misses(a, b, start)) return;
      const size_t before = found_.size();
      add(a, b, before);
      add(b, a, before);
    });
    std::sort(found_.begin(), found_.end());
    placed_.pairs.clear();
    placed_.points = 0;
    for (const Found& f : found_) {
      const Seat &a = placed_.seats[f.a], &b = placed_.seats[f.b];
      const auto n = size_t(points(a.shape.kind, b.shape.kind, Ends::off));
      placed_.pairs.push_back({sides_[f.sides].contact, f.a, f.b, placed_.points, n});
      placed_.points += n;
    }
  }
  /// The seats and stops of the model, and the pairs of the last find().
  const ContactModel::Placed& placed() const { return placed_; }
  /// Of a pair of the last find(), the same in every step; below `numbers()`.
  std::uint64_t number(size_t pair) const { return found_[pair].number; }
  std::uint64_t numbers() const { return first_.back(); }
  /// How far a surface goes, and a little more for rounding [m].
  static double moved(const Pose& from, const Pose& to) { return margin + norm(to.r - from.r); }

 private:
  using Seat = ContactModel::Seat;
  static constexpr double margin = 5e-10;  ///< of a surface [m]
  struct Found {
    std::uint64_t number;
    size_t sides, a, b;
    // NOLINTNEXTLINE(modernize-use-nullptr): a 0 of the compiler, not of this line
    auto operator<=>(const Found&) const = default;
  };
  /// The contacts that have a seat on a side, and the place there.
  struct Place {
    size_t sides, at;
  };
  struct Places {
    std::vector<Place> a, b;
  };
  static const Place* find_in(const std::vector<Place>& all, size_t sides) {
    const auto at = std::lower_bound(all.begin(), all.end(), sides,
                                     [](const Place& p, size_t k) { return p.sides < k; });
    return at != all.end() && at->sides == sides ? &*at : nullptr;
  }
  /// The contacts with a on one side and b on the other, but for those found since `before`: the
  /// same two the other way round.
  void add(size_t a, size_t b, size_t before) {
    const auto &of_a = of_[a].a, &of_b = of_[b].b;
    const bool by_a = of_a.size() <= of_b.size();
    const bool connected = model_.connected(placed_.seats[a].node, placed_.seats[b].node);
    for (const Place& one : by_a ? of_a : of_b) {
      const Place* const other = find_in(by_a ? of_b : of_a, one.sides);
      if (!other) continue;
      if (connected && find_in(of_[a].b, one.sides) && find_in(of_[b].a, one.sides)) continue;
      const auto known = [&](const Found& f) { return f.sides == one.sides; };
      if (std::any_of(found_.begin() + long(before), found_.end(), known)) continue;
      const size_t i = by_a ? one.at : other->at, j = by_a ? other->at : one.at;
      found_.push_back({first_[one.sides] + i * sides_[one.sides].b.size() + j, one.sides, a, b});
    }
  }
  /// Whether one is a plane of the world that the other does not reach.
  bool misses(size_t a, size_t b, std::span<const Pose> start) const {
    if (placed_.seats[a].shape.kind != Kind::plane) std::swap(a, b);
    if (placed_.seats[a].shape.kind != Kind::plane || placed_.seats[a].node >= 0) return false;
    return dot(start[a].R.z, start[b].r - start[a].r) > bounds_[b].radius + margin;
  }

  const ContactModel& model_;
  const std::vector<ContactModel::Sides>& sides_;
  ContactModel::Placed placed_;
  Neighbours neighbours_;
  std::vector<Bound> bounds_;         ///< of the seats
  std::vector<Places> of_;            ///< of the seats
  std::vector<std::uint64_t> first_;  ///< of each contact: the number of its first pair
  std::vector<Found> found_;
};

}  // namespace porthos::contact
