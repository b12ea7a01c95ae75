#include "contact/soft_touches.h"

#include <algorithm>

#include "contact/detail/point_forces.h"
#include "mechanics/hamiltonian_field.h"

namespace porthos::contact {
namespace {

/// Half of the least extent of a shape, without end of a plane [m].
double half_size(const Shape& s) {
  switch (s.kind) {
    case Kind::plane:
      return std::numeric_limits<double>::infinity();
    case Kind::box:
      return std::min({s.half.x, s.half.y, s.half.z});
    case Kind::cylinder:
      return std::min(s.radius, s.half_length);
    case Kind::sphere:
    case Kind::capsule:
      break;
  }
  return s.radius;
}

}  // namespace

class SoftTouches::Impl {
 public:
  explicit Impl(const ContactModel& model)
      : model_(model),
        gaps_(model.mechanism(), model.soft()),
        q_(size_t(model.mechanism().nq())),
        p_(q_.size()),
        angles_(size_t(model.mechanism().angle_count())),
        touches_(model.contacts().size()) {}

  std::span<const SoftTouch> at(const phs::State& s) {
    for (size_t i = 0; i < q_.size(); ++i) {
      q_[i] = s.x[i] + s.lo[i];
      p_[i] = s.x[q_.size() + i] + s.lo[q_.size() + i];
    }
    for (size_t i = 0; i < angles_.size(); ++i) angles_[i] = double(s.turns[i]) * phs::two_pi_hi;
    gaps_.set_turn_angles(angles_);
    mechanics::rates_from_momenta<double>(model_.mechanism(), gaps_.w, q_, p_);
    gaps_.place(q_);
    std::fill(touches_.begin(), touches_.end(), SoftTouch{});
    for (size_t k = 0; k < model_.soft().pairs.size(); ++k) add(k);
    return touches_;
  }

 private:
  void add(size_t pair) {
    const auto& placed = model_.soft();
    const auto& p = placed.pairs[pair];
    const Law& law = model_.contacts()[p.contact].law;
    SoftTouch& own = touches_[p.contact];
    for (size_t i = p.first; i < p.first + p.points; ++i) {
      const double depth = -gaps_.touch[i].gap, elastic = elastic_force(law, depth);
      const Slip<double> v = slip(gaps_, pair, i);
      const auto c = resistance(law, elastic, v);
      const double normal = elastic + c.loss * v.depth_rate;
      own.energy += elastic_energy(law, depth);
      own.pressed += normal;
      own.force += c.friction * v.along - normal * gaps_.touch[i].n;
      if (!(depth > own.depth)) continue;
      own.depth = depth;
      const Shape &a = placed.seats[p.a].shape, &b = placed.seats[p.b].shape;
      own.half_size = std::min(half_size(a), half_size(b));
      if (have_edges(a.kind, b.kind)) own.half_size = std::min(own.half_size, a.radius + b.radius);
    }
  }

  const ContactModel& model_;
  Gaps<double> gaps_;
  std::vector<double> q_, p_, angles_;
  std::vector<SoftTouch> touches_;
};

SoftTouches::SoftTouches(const ContactModel& model) : impl_(std::make_unique<Impl>(model)) {}
SoftTouches::SoftTouches(SoftTouches&&) noexcept = default;
SoftTouches::~SoftTouches() = default;

std::span<const SoftTouch> SoftTouches::at(const phs::State& state) { return impl_->at(state); }

}  // namespace porthos::contact
