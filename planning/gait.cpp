#include "planning/gait.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "phs/error.h"

namespace porthos::planning {
namespace {

using mechanics::Vec3d;

// The memory: 1 while it steps, when its period began, swings, the first of them, ξ; then of each
// foot where it lands, what it does, the height where it left the ground, and its horizontal place,
// rate and acceleration.
enum Of { stepping, began, swung, first_swing };
enum OfFoot { landing_at, doing = 3, left_at, place_at, rate_at = 7, acceleration_at = 9 };
constexpr double not_known = 0, stands_there = 1, swings = 2;  // of doing

constexpr double tiny = 1e-9;  ///< instants are multiples of a period up to rounding [s]

double wrapped(double t, double period) { return t - period * std::floor((t + tiny) / period); }
Vec3d level(const Vec3d& a) { return {a.x, a.y, 0}; }
double along(const Vec3d& a, double angle) { return a.x * std::cos(angle) + a.y * std::sin(angle); }

/// How far a place is outside of the hull of points; inside it is negative.
double outside(const Vec3d& at, const std::vector<Vec3d>& points) {
  double most = -HUGE_VAL;
  for (int k = 0; k < 72; ++k) {
    const double angle = 2 * M_PI * k / 72;
    double edge = -HUGE_VAL;
    for (const Vec3d& p : points) edge = std::max(edge, along(p, angle));
    most = std::max(most, along(at, angle) - edge);
  }
  return most;
}

/// One coordinate on its curve of fifth degree to a place with rate and acceleration 0.
struct Curve {
  double x, v, a;
  void advance(double to, double rest, double dt) {
    if (rest <= dt + tiny) {
      *this = {to, 0, 0};
      return;
    }
    const double T = rest, d = to - x - v * T - a * T * T / 2, e = -v - a * T;
    const double c3 = (10 * d / T - 4 * e - a * T / 2) / (T * T);
    const double c4 = (-15 * d / T + 7 * e + a * T) / (T * T * T);
    const double c5 = (6 * d / T - 3 * e - a * T / 2) / (T * T * T * T);
    const double s = dt;
    *this = {x + s * (v + s * (a / 2 + s * (c3 + s * (c4 + s * c5)))),
             v + s * (a + s * (3 * c3 + s * (4 * c4 + s * 5 * c5))),
             a + s * (6 * c3 + s * (12 * c4 + s * 20 * c5))};
  }
};

}  // namespace

Gait::Gait(GaitDesign design, std::vector<Vec3d> feet, double height, double g)
    : d_(std::move(design)), n_(std::move(feet)) {
  const auto need = [](bool holds, const char* what, double found, const char* expected) {
    if (!holds)
      throw InvalidArgument(fmt::format("{} is {:g}, expected {}", what, found, expected));
  };
  need(d_.period > 0, "the period of a gait", d_.period, "more than 0 s");
  need(d_.duty > 0 && d_.duty < 1, "duty", d_.duty, "more than 0 and less than 1");
  need(d_.swing.size() == n_.size() && !n_.empty(), "the number of swings", double(d_.swing.size()),
       fmt::format("that of the feet, {}", n_.size()).c_str());
  need(height > 0 && g > 0, "the height of the centre of mass above the ground", height,
       "more than 0, and gravity");
  w_ = std::sqrt(g / height);
  Vec3d mean{0, 0, 0};
  for (const Vec3d& foot : n_) mean += (1 / double(n_.size())) * foot;
  ground_ = mean.z;
  for (Vec3d& foot : n_) foot = level(foot - mean);
  const double T = d_.period;
  std::vector<double> events;
  for (const double s : d_.swing) {
    need(s >= 0 && s < 1, "the begin of a swing", s, "from 0 to less than 1, a part of the period");
    events.push_back(s * T);
    events.push_back(wrapped((s + 1 - d_.duty) * T, T));
  }
  std::ranges::sort(events);
  const Vec3d v{d_.velocity[0], d_.velocity[1], 0};
  // Of the steady gait, of which the middle of the feet is at v t.
  const auto stance = [&](size_t i, double t) {
    const double landed = t - wrapped(t - (d_.swing[i] + 1 - d_.duty) * T, T);
    return n_[i] + (landed + d_.duty * T / 2) * v;
  };
  for (size_t k = 0; k < events.size(); ++k) {
    const double next = k + 1 < events.size() ? events[k + 1] : events[0] + T;
    if (next - events[k] < tiny) continue;
    Part part{events[k], next - events[k], {}, {0, 0, 0}, {0, 0, 0}};
    double standing = 0;
    for (size_t i = 0; i < n_.size(); ++i) {
      const double since = wrapped(part.begin - d_.swing[i] * T, T);
      part.stands.push_back(since >= (1 - d_.duty) * T - tiny);
      if (!part.stands.back()) continue;
      part.pivot += stance(i, part.begin);
      standing += 1;
    }
    need(standing > 0, "the number of feet that stand", 0,
         fmt::format("one or more; none stands from {:g} s of the period on", part.begin).c_str());
    part.pivot = (1 / standing) * part.pivot;
    parts_.push_back(part);
  }
  // Backwards in time ξ comes to p: ξ(begin) = p + (ξ(end) - p) e^{-ω duration}; after a period it
  // has moved by v T.
  const auto backwards = [&](Vec3d xi) {
    for (auto part = parts_.rbegin(); part != parts_.rend(); ++part)
      part->capture = xi = part->pivot + std::exp(-w_ * part->duration) * (xi - part->pivot);
    return xi;
  };
  const Vec3d once = backwards(T * v);
  backwards((1 / (1 - std::exp(-w_ * T))) * once + T * v);
  for (size_t i = 0; i < n_.size(); ++i) {
    const double landed = wrapped((d_.swing[i] + 1 - d_.duty) * T, T);
    offset_.push_back(parts_[part_at(landed)].capture - stance(i, landed));
  }
}

size_t Gait::part_at(double phase) const {
  size_t k = parts_.size() - 1;  // of times before the first begin, too
  for (size_t i = 0; i < parts_.size(); ++i)
    if (parts_[i].begin <= phase + tiny) k = i;
  return k;
}

/// Of the feet that should stand and are on the ground; of all that should, if none is.
Vec3d Gait::middle(const Seen& s, const std::vector<char>& stands) const {
  for (const bool any : {false, true}) {
    Vec3d sum{0, 0, 0};
    double count = 0;
    for (size_t i = 0; i < n_.size(); ++i)
      if (stands[i] && (any || s.closed[i])) {
        sum += s.feet[i];
        count += 1;
      }
    if (count > 0) return Vec3d{sum.x / count, sum.y / count, ground_};
  }
  return {s.centre.x, s.centre.y, ground_};
}

void Gait::begin_or_end(const Seen& s, const Vec3d& xi, std::span<double> memory) const {
  if (!d_.when_pushed) {
    if (memory[stepping] > 0 || s.t < d_.start - tiny) return;
    memory[stepping] = 1;
    memory[began] = d_.start;
    return;
  }
  if (s.points.empty() || s.t < d_.start - tiny) return;
  const double out = outside(xi, s.points);
  if (memory[stepping] > 0) {
    const bool all = std::ranges::all_of(s.closed, [](char c) { return c != 0; });
    const bool whole = s.t - memory[began] >= d_.period - tiny;
    if (all && whole && out < -2 * d_.margin) memory[stepping] = 0;
    return;
  }
  if (out < -d_.margin) return;
  size_t last = 0;  // the foot that carries least goes first
  for (size_t i = 1; i < n_.size(); ++i)
    if (mechanics::norm(level(s.feet[i] - xi)) > mechanics::norm(level(s.feet[last] - xi)) + 1e-3)
      last = i;
  memory[stepping] = 1;
  memory[began] = s.t - d_.swing[last] * d_.period;
}

Vec3d Gait::landing(const Seen& s, size_t foot, const Plan& p, double rest,
                    const std::vector<char>& stands) const {
  const double grown = std::exp(w_ * rest);
  Vec3d to = p.pivot + grown * (p.capture - p.pivot) - offset_[foot];
  const Vec3d mean = p.pivot + std::cosh(w_ * rest) * (s.centre - p.pivot) +
                     (std::sinh(w_ * rest) / w_) * s.moving;
  const Vec3d below = mean + n_[foot], away = level(to - below);
  if (const double far = mechanics::norm(away); far > d_.reach)
    to = below + (d_.reach / far) * away;
  for (size_t k = 0; k < n_.size(); ++k) {
    if (!stands[k]) continue;
    const Vec3d apart = n_[foot] - n_[k];
    const double distance = mechanics::norm(apart);
    if (!(distance > tiny)) continue;
    const Vec3d e = (1 / distance) * apart;
    const double lacks = d_.spacing * distance - mechanics::dot(e, level(to - s.feet[k]));
    if (lacks > 0) to += lacks * e;
  }
  to.z = ground_;
  return to;
}

void Gait::swing(const Seen& s, size_t foot, double phase, Plan& p, const std::vector<char>& stands,
                 std::span<double> own) const {
  const double lasts = (1 - d_.duty) * d_.period;
  const double since = wrapped(phase - d_.swing[foot] * d_.period, d_.period);
  const double rest = lasts - since;
  if (own[doing] != swings) {
    own[doing] = swings;
    own[left_at] = s.feet[foot].z;
    for (size_t k = 0; k < 2; ++k) {
      own[place_at + k] = s.feet[foot][int(k)];
      own[rate_at + k] = own[acceleration_at + k] = 0;
    }
  }
  if (rest > 0.2 * lasts) {  // later a change would need large accelerations
    const Vec3d to = landing(s, foot, p, rest, stands);
    for (int k = 0; k < 3; ++k) own[size_t(k)] = to[k];
  }
  const double x = std::clamp(since / lasts, 0.0, 1.0), y = 1 - x;
  const double drop = ground_ - own[left_at], h = 64 * d_.clearance;
  Swing& now = p.feet[foot];
  now = {true, true, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  // Up and down: 64 h x³(1-x)³, and from where it left the ground to the ground.
  now.at.z = own[left_at] + drop * x * x * x * (10 - 15 * x + 6 * x * x) + h * std::pow(x * y, 3);
  now.rate.z = (30 * drop + 3 * h * (y - x)) * x * x * y * y / lasts;
  now.acceleration.z =
      (60 * drop * x * y * (y - x) + h * (6 * x * y * (y - x) * (y - x) - 6 * x * x * y * y)) /
      (lasts * lasts);
  for (size_t k = 0; k < 2; ++k) {
    Curve c{own[place_at + k], own[rate_at + k], own[acceleration_at + k]};
    now.at[int(k)] = c.x;
    now.rate[int(k)] = c.v;
    now.acceleration[int(k)] = c.a;
    c.advance(own[landing_at + k], rest, s.dt);
    own[place_at + k] = c.x;
    own[rate_at + k] = c.v;
    own[acceleration_at + k] = c.a;
  }
}

Gait::Plan Gait::plan(const Seen& s, std::span<double> memory) const {
  Plan p;
  p.feet.resize(n_.size());
  p.capture = s.centre + (1 / w_) * s.moving;
  p.capture.z = ground_;
  for (int k = 0; k < 3; ++k) memory[capture_at + size_t(k)] = p.capture[k];
  begin_or_end(s, p.capture, memory);
  const bool steps = memory[stepping] > 0;
  const double phase = wrapped(s.t - memory[began], d_.period);
  const size_t now = part_at(phase), next = (now + 1) % parts_.size();
  const std::vector<char> all(n_.size(), 1);
  const auto& stands = steps ? parts_[now].stands : all;
  p.pivot = p.wanted = middle(s, stands);
  for (size_t i = 0; i < n_.size(); ++i) {
    const auto own = memory.subspan(footstep_at(i), of_foot);
    if (steps && !stands[i]) {
      if (own[doing] != swings && memory[swung]++ == 0) memory[first_swing] = s.t;
      swing(s, i, phase, p, stands, own);
      continue;
    }
    if (s.closed[i] || own[doing] == not_known)
      for (int k = 0; k < 3; ++k) own[size_t(k)] = s.feet[i][k];
    if (!s.closed[i]) p.feet[i] = {false, true, {own[0], own[1], ground_}, {0, 0, 0}, {0, 0, 0}};
    own[doing] = stands_there;
  }
  if (!steps) return p;
  const Part &part = parts_[now], &then = parts_[next];
  const double since = wrapped(phase - part.begin, d_.period), rest = part.duration - since;
  bool known = true;  // where the next feet stand
  for (size_t i = 0; i < n_.size(); ++i) known &= !then.stands[i] || (stands[i] && s.closed[i]);
  if (known) {
    // ξ is to be at its offset from the feet that stand next, when they do.
    const Vec3d end = middle(s, then.stands) + (then.capture - then.pivot);
    p.wanted += std::exp(-w_ * rest) * (end - p.pivot);
  } else {
    p.wanted += std::exp(w_ * since) * (part.capture - part.pivot);
  }
  p.wanted.z = ground_;
  return p;
}

Vec3d Gait::acceleration(const Plan& p, const Vec3d& centre, double k) const {
  const Vec3d zmp = p.pivot + (1 + k / w_) * (p.capture - p.wanted);
  return w_ * w_ * level(centre - zmp);
}

}  // namespace porthos::planning
