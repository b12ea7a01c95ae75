#include "report/detail/playback.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "mechanics/hamiltonian_field.h"
#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "report/detail/shapes.h"
#include "scene/plot/apart_by_size.h"
#include "scene/run/columns.h"
#include "scene/run/row_times.h"
#include "scene/session/moved.h"

namespace porthos::report {
namespace {

using mechanics::Transform;
using scene::evenly;

class Clip {
 public:
  Clip(const Stage& stage, const std::vector<std::int64_t>& rows, const Part& part)
      : m_(*stage.mechanism),
        w_(m_),
        pose_(m_.nodes().size()),
        part_(part),
        frames_(rows.size()),
        rate_(size_t(m_.nv()), 0.0) {
    t_ = stage.records->at("time", rows);
    if (!read("state/", *stage.records, rows, q_))
      throw InvalidArgument("the records do not have every coordinate");
    moving_ = read("momentum/", *stage.records, rows, p_);
    read_turns(*stage.records, rows);
    read_forces(stage, rows);
    if (stage.records->has("state/orbit.position")) {
      const auto p = stage.records->at("state/orbit.position", rows),
                 v = stage.records->at("state/orbit.velocity", rows);
      for (size_t f = 0; f < frames_; ++f) {
        orbit_.insert(orbit_.end(), p.begin() + long(3 * f), p.begin() + long(3 * f + 3));
        orbit_.insert(orbit_.end(), v.begin() + long(3 * f), v.begin() + long(3 * f + 3));
      }
    }
    for (size_t f = 0; f < frames_; ++f) frame(f);
  }
  Json json(const char* name) const {
    Json j = {
        {"name", name},  {"t", base64(t_)},  {"origin", base64(origin_)}, {"poses", base64(poses_)},
        {"turn", turn_}, {"forces", forces_}};
    if (!momenta_.empty()) j["momenta"] = base64(momenta_);
    if (!orbit_.empty()) j["orbit"] = base64(orbit_);
    return j;
  }

 private:
  /// The coordinates or momenta of all frames; false: the records lack one.
  bool read(const char* kind, const Records& r, const std::vector<std::int64_t>& rows,
            std::vector<double>& to) {
    const size_t nq = size_t(m_.nq());
    to.assign(frames_ * nq, 0);
    for (const auto& c : m_.coordinates()) {
      const std::string name = kind + scene::link_name(c.name);
      const auto v = r.at(name, rows);
      if (v.size() != frames_ * size_t(c.nq)) return false;
      for (size_t f = 0; f < frames_; ++f)
        std::copy_n(v.begin() + long(f) * c.nq, c.nq, to.begin() + long(f * nq) + c.q);
    }
    return true;
  }
  void read_turns(const Records& r, const std::vector<std::int64_t>& rows) {
    turns_.assign(frames_ * size_t(m_.angle_count()), 0.0);
    if (!r.has("turns")) return;
    const auto names = r.columns("turns");
    const auto v = r.at("turns", rows);
    size_t angle = 0;
    for (const auto& c : m_.coordinates()) {
      if (c.kind != phs::BlockKind::angle) continue;
      const auto at = std::find(names.begin(), names.end(), c.name) - names.begin();
      if (size_t(at) < names.size() && v.size() == frames_ * names.size())
        for (size_t f = 0; f < frames_; ++f)
          turns_[f * size_t(m_.angle_count()) + angle] = v[f * names.size() + size_t(at)];
      ++angle;
    }
  }

  void read_forces(const Stage& stage, const std::vector<std::int64_t>& rows) {
    for (const auto& [output, joint] : stage.wrenches)
      for (const auto& b : stage.bodies) {
        if (b.joint.name != joint || !stage.records->has("output/" + output)) continue;
        const auto w = stage.records->at("output/" + output, rows);
        if (w.size() != 6 * frames_) continue;
        std::vector<float> force;  // after the moment
        for (size_t f = 0; f < frames_; ++f)
          for (size_t k = 3; k < 6; ++k) force.push_back(float(w[6 * f + k]));
        forces_.push_back({{"body", b.joint.turned ? b.parent : b.name}, {"v", base64(force)}});
      }
  }

  void frame(size_t f) {
    const size_t nq = size_t(m_.nq()), angles = size_t(m_.angle_count());
    for (size_t a = 0; a < angles; ++a) w_.turn_angle[a] = phs::two_pi_hi * turns_[f * angles + a];
    mechanics::forward_kinematics<double>(m_, w_, std::span(q_).subspan(f * nq, nq), pose_);
    const auto origin = orbit_.empty() ? origin_of(m_, pose_) : mechanics::Vec3d{0, 0, 0};
    for (const double x : {origin.x, origin.y, origin.z}) origin_.push_back(x);
    if (moving_) add_momenta(f, origin);
    add_poses(pose_, origin, poses_);
    const std::vector<double> before_rate = rate_;
    if (moving_) find_rates(f);
    if (f == 0 || t_[f] <= part_.from || t_[f - 1] >= part_.to) return;
    turn_ = std::max(turn_, swung(before_rate, t_[f] - t_[f - 1]));
    for (size_t i = 0; i < pose_.size(); ++i) {
      const float* now = poses_.data() + 7 * (f * pose_.size() + i) + 3;
      const float* before = now - 7 * pose_.size();
      double cosine = 0;
      for (int k = 0; k < 4; ++k) cosine += double(now[k]) * double(before[k]);
      turn_ = std::max(turn_, 2 * std::acos(std::min(1.0, std::fabs(cosine))));
    }
  }
  void find_rates(size_t f) {
    const size_t nq = size_t(m_.nq());
    mechanics::rates_from_momenta<double>(m_, w_, std::span<const double>(q_).subspan(f * nq, nq),
                                          std::span<const double>(p_).subspan(f * nq, nq));
    std::copy_n(w_.rate.begin(), rate_.size(), rate_.begin());
  }
  /// How far a joint turns in the time h by its mean rate, to and fro [rad]: of the one that turns
  /// farthest.
  double swung(const std::vector<double>& before, double h) const {
    double most = 0;
    for (const auto& c : m_.coordinates()) {
      if (c.kind != phs::BlockKind::angle && c.kind != phs::BlockKind::rotation) continue;
      const auto size = [&](const std::vector<double>& rate) {
        double square = 0;
        for (int k = 0; k < c.nv; ++k) square += rate[size_t(c.v + k)] * rate[size_t(c.v + k)];
        return std::sqrt(square);
      };
      most = std::max(most, 0.5 * h * (size(before) + size(rate_)));
    }
    return most;
  }
  void add_momenta(size_t f, const mechanics::Vec3d& origin) {
    const size_t nq = size_t(m_.nq());
    const auto q = std::span<const double>(q_).subspan(f * nq, nq);
    const auto total =
        mechanics::momentum<double>(m_, w_, q, std::span<const double>(p_).subspan(f * nq, nq));
    const auto c = mechanics::centre_of_mass<double>(m_, w_, q);
    for (const auto& v : {c - origin, total.linear, total.angular - cross(c, total.linear)})
      for (const double x : {v.x, v.y, v.z}) momenta_.push_back(float(x));
  }
  const mechanics::Mechanism& m_;
  mechanics::Workspace<double> w_;
  std::vector<Transform<double>> pose_;
  Part part_;
  size_t frames_;
  bool moving_ = false;
  std::vector<double> t_, q_, p_, turns_, origin_, orbit_, rate_;
  std::vector<float> poses_, momenta_;
  Json forces_ = Json::array();
  double turn_ = 0;
};

}  // namespace

mechanics::Vec3d origin_of(const mechanics::Mechanism& m, std::span<const Transform<double>> pose) {
  const auto stands = [](const mechanics::BodyFrame& b) { return b.node < 0; };
  if (pose.empty() || m.nodes()[0].parent >= 0 || std::ranges::any_of(m.bodies(), stands))
    return {0, 0, 0};
  for (const auto& c : m.coordinates())
    if (c.node == 0 && c.kind == phs::BlockKind::linear && c.nq == 3) return pose[0].r;
  return {0, 0, 0};
}

void add_poses(std::span<const Transform<double>> pose, const mechanics::Vec3d& origin,
               std::vector<float>& to) {
  for (const auto& p : pose) {
    const auto r = p.r - origin;
    for (const double x : {r.x, r.y, r.z}) to.push_back(float(x));
    for (const double x : quaternion_of(p.R)) to.push_back(float(x));
  }
}

Json motion(const Stage& stage, std::int64_t most, bool whole) {
  const Records& r = *stage.records;
  Json panels = Json::array();
  const auto shown = scene::Shown::bands(r.count(), most);
  auto drawn_panels = scene::panels_of(r, *stage.mechanism, stage.springs, shown, stage.run);
  if (whole) drawn_panels = scene::apart_by_size(std::move(drawn_panels));
  for (const auto& p : drawn_panels) {
    Json lines = Json::array();
    for (const auto& l : p.lines) {
      lines.push_back(
          {{"name", l.name}, {"v", base64(std::vector<float>(l.value.begin(), l.value.end()))}});
      if (scene::is_held(l.value)) lines.back()["held"] = true;
    }
    panels.push_back({{"what", p.what}, {"lines", lines}});
  }
  std::vector<double> holes;
  if (stage.recorded) holes = scene::before_holes(r.column("time"));
  return {{"t", base64(shown.times(r.at("time", shown.rows())))},
          {"holes", base64(holes)},
          {"panels", panels}};
}

namespace {

/// The records of a playback, equally far apart: all, or those of a part with the one before it and
/// the one after it, so that a path is of the part alone.
std::vector<std::int64_t> frames_of(const Records& r, std::int64_t most, const Part& part) {
  if (part.whole()) return evenly(r.count(), most);
  const auto t = r.column("time");
  const std::int64_t first =
      std::max<std::int64_t>(0, std::upper_bound(t.begin(), t.end(), part.from) - t.begin() - 1);
  const std::int64_t last = std::min<std::int64_t>(
      r.count() - 1, std::lower_bound(t.begin(), t.end(), part.to) - t.begin());
  std::vector<std::int64_t> rows = evenly(last - first + 1, most);
  for (std::int64_t& row : rows) row += first;
  if (last > first && rows[rows.size() - 2] != last - 1) rows.insert(rows.end() - 1, last - 1);
  return rows;
}

}  // namespace

Json playback(const Stage& stage, std::int64_t most, const Part& part) {
  const auto& m = *stage.mechanism;
  Json bodies = shapes_of(stage.bodies, stage.urdf, stage.touching, *stage.meshes);
  std::map<std::string, const mechanics::BodyFrame*> frames;
  for (const auto& b : m.bodies()) frames[b.name] = &b;
  for (auto& b : bodies) {
    const auto f = frames.find(b["name"].get<std::string>());
    if (f == frames.end()) continue;
    const auto& at = *f->second;
    b["node"] = at.node;
    b["p"] = {at.pose.r.x, at.pose.r.y, at.pose.r.z};
    b["q"] = quaternion_of(at.pose.R);
  }
  const std::int64_t records = stage.records->count();
  const bool all = records <= most;
  Json clips = Json::array();
  const auto rows = frames_of(*stage.records, all || !part.whole() ? most : most / 2, part);
  clips.push_back(Clip(stage, rows, part).json("whole run"));
  if (!all && part.whole())
    clips.push_back(Clip(stage, evenly(most / 2, most / 2), {}).json("beginning"));
  const auto& g = stage.gravity;
  Json world = Json::array();
  for (const auto& s : stage.world) world.push_back(drawn(s));
  return {{"bodies", bodies},
          {"world", world},
          {"nodes", m.nodes().size()},
          {"gravity", {g.x, g.y, g.z}},
          {"clips", clips}};
}

}  // namespace porthos::report
