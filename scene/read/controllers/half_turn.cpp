#include "scene/read/controllers/half_turn.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mechanics/kinematics.h"
#include "mechanics/rotation.h"
#include "mechanics/urdf.h"
#include "scene/files/hdf5_file.h"
#include "scene/read/scene.h"

namespace porthos::scene {

std::array<double, 4> start_attitude(const ControllerPlant& plant, const std::string& link) {
  const auto& m = plant.model->mechanism();
  const Scene& scene = plant.scene;
  auto q = stated_start(plant);
  const auto put = [&q](const mechanics::JointCoordinates& c, const double* wxyz) {
    std::copy_n(wxyz, 4, q.begin() + c.q);
  };
  for (const auto& c : m.coordinates()) {
    if (c.kind != phs::BlockKind::rotation) continue;
    if (c.joint == mechanics::base_joint_name) put(c, scene.base.attitude_wxyz);
    if (const auto s = scene.joints.find(c.joint); s != scene.joints.end() && s->second.motion)
      put(c, s->second.motion->attitude_wxyz);
    if (!scene.start_from) continue;
    const auto& record = scene.start_from->state;
    if (const auto s = record.find(link_name(c.name)); s != record.end() && s->second.x.size() == 4)
      put(c, s->second.x.data());
  }
  mechanics::Workspace<double> w(m);
  std::vector<mechanics::Transform<double>> poses(m.nodes().size());
  mechanics::forward_kinematics<double>(m, w, q, poses);
  return mechanics::quaternion_of(mechanics::body_pose<double>(m, m.body(link), poses).R);
}

bool near_half_turn(const std::array<double, 4>& from, const std::array<double, 4>& to,
                    const mechanics::Vec3d& stiffness) {
  using Quaternion = mechanics::Quaternion<double>;
  constexpr double near = 5 * std::numbers::pi / 180;
  const auto [w, v] = Quaternion::load(to.data()).conj() * Quaternion::load(from.data());
  if (std::fabs(w) > std::sin(near / 2)) return false;
  // U = 2 Σ b_i v_i², whose moment is 2 (w b v + (b v) × v) for b_i = a_j + a_k.
  const auto& a = stiffness;
  const mechanics::Vec3d b{a.y + a.z, a.z + a.x, a.x + a.y}, bv{b.x * v.x, b.y * v.y, b.z * v.z};
  const double stiffest = std::max({b.x, b.y, b.z});
  return stiffest > 0 && 2 * mechanics::norm(w * bv + cross(bv, v)) <= std::sin(near) * stiffest;
}

std::string half_turn_of_pose(const std::string& link) {
  return fmt::format(
      "the attitude of '{}' is a half turn from the start, where its torque is zero: it begins "
      "late or never; hold an attitude on the way first",
      link);
}

void add_sentence(std::string& remark, const std::string& sentence) {
  if (!sentence.empty()) remark += (remark.empty() ? "" : "; ") + sentence;
}

}  // namespace porthos::scene
