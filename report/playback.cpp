#include "report/detail/playback.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "mechanics/kinematics.h"
#include "mechanics/momentum.h"
#include "report/detail/shapes.h"
#include "scene/run/columns.h"
#include "scene/run/row_times.h"
#include "scene/session/moved.h"

namespace porthos::report {
namespace {

using mechanics::Transform;
using scene::evenly;

class Clip {
 public:
  Clip(const Stage& stage, const std::vector<std::int64_t>& rows)
      : m_(*stage.mechanism), w_(m_), pose_(m_.nodes().size()), frames_(rows.size()) {
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
    if (f == 0) return;
    for (size_t i = 0; i < pose_.size(); ++i) {
      const float* now = poses_.data() + 7 * (f * pose_.size() + i) + 3;
      const float* before = now - 7 * pose_.size();
      double cosine = 0;
      for (int k = 0; k < 4; ++k) cosine += double(now[k]) * double(before[k]);
      turn_ = std::max(turn_, 2 * std::acos(std::min(1.0, std::fabs(cosine))));
    }
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
  size_t frames_;
  bool moving_ = false;
  std::vector<double> t_, q_, p_, turns_, origin_, orbit_;
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

Json motion(const Stage& stage, std::int64_t most) {
  const Records& r = *stage.records;
  Json panels = Json::array();
  for (const auto& p : scene::panels_of(r, *stage.mechanism, stage.springs, most, stage.run)) {
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
  return {{"t", base64(r.at("time", scene::thinned(r.count(), most)))},
          {"holes", base64(holes)},
          {"panels", panels}};
}

Json playback(const Stage& stage, std::int64_t most) {
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
  clips.push_back(Clip(stage, evenly(records, all ? most : most / 2)).json("whole run"));
  if (!all) clips.push_back(Clip(stage, evenly(most / 2, most / 2)).json("beginning"));
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
